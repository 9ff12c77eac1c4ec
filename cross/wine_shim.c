/* For tests alone: functions that Debian 12's Wine lacks, and packages call. Those of Microsoft's C library have the
 * prefix stepdiag_; wine_shims.py finds them here. */
#include <complex.h>
#include <fenv.h>
#include <math.h>
#include <string.h>
#include <windows.h>

BOOLEAN NTAPI SystemFunction036(void* buffer, ULONG size); /* RtlGenRandom */

__declspec(dllexport) BOOL ProcessPrng(BYTE* data, SIZE_T size) { return SystemFunction036(data, (ULONG)size); }

/* Rounding and traps stay as they are: that is how they are in Python. */
__declspec(dllexport) int stepdiag_feholdexcept(fenv_t* environment) {
    (void)environment;
    return 0;
}
__declspec(dllexport) int stepdiag_fesetenv(const fenv_t* environment) {
    (void)environment;
    return 0;
}

/* Microsoft's complex numbers are structures, and its long double is a double. */
typedef struct {
    float re, im;
} Single;
typedef struct {
    double re, im;
} Double;

static double _Complex of_single(Single z) { return z.re + I * z.im; }
static double _Complex of_double(Double z) {
    double _Complex value;
    memcpy(&value, &z, sizeof value);
    return value;
}
static Single to_single(double _Complex value) { return (Single){(float)creal(value), (float)cimag(value)}; }
static Double to_double(double _Complex value) { return (Double){creal(value), cimag(value)}; }

#define REAL(name)                                                                                        \
    __declspec(dllexport) double stepdiag_##name(Double z) { return name(of_double(z)); }                 \
    __declspec(dllexport) double stepdiag_##name##l(Double z) { return name(of_double(z)); }              \
    __declspec(dllexport) float stepdiag_##name##f(Single z) { return (float)name(of_single(z)); }
#define COMPLEX(name)                                                                                     \
    __declspec(dllexport) Double stepdiag_##name(Double z) { return to_double(name(of_double(z))); }      \
    __declspec(dllexport) Double stepdiag_##name##l(Double z) { return to_double(name(of_double(z))); }   \
    __declspec(dllexport) Single stepdiag_##name##f(Single z) { return to_single(name(of_single(z))); }

REAL(cabs)
REAL(carg)
REAL(cimag)
REAL(creal)
COMPLEX(ccos)
COMPLEX(ccosh)
COMPLEX(cexp)
COMPLEX(csin)
COMPLEX(csinh)
COMPLEX(ctan)
COMPLEX(ctanh)

__declspec(dllexport) Double stepdiag_cpow(Double a, Double b) { return to_double(cpow(of_double(a), of_double(b))); }
__declspec(dllexport) Double stepdiag_cpowl(Double a, Double b) { return stepdiag_cpow(a, b); }
__declspec(dllexport) Single stepdiag_cpowf(Single a, Single b) { return to_single(cpow(of_single(a), of_single(b))); }
