/* For tests alone: functions that Debian 12's Wine lacks, and packages call. Those of Microsoft's C library have the
 * prefix stepdiag_; wine_shims.py finds them here. */
#include <fenv.h>
#include <math.h>
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

/* Microsoft's complex numbers are structures, and its long double is a double. <complex.h> would call what Wine lacks.
 */
typedef struct {
    float re, im;
} Single;
typedef struct {
    double re, im;
} Double;

static Double times_i(Double z) { return (Double){-z.im, z.re}; }
static Double over_i(Double z) { return (Double){z.im, -z.re}; }

static double absolute(Double z) { return hypot(z.re, z.im); }
static double argument(Double z) { return atan2(z.im, z.re); }
static double real_part(Double z) { return z.re; }
static double imaginary_part(Double z) { return z.im; }
static Double exponential(Double z) { return (Double){exp(z.re) * cos(z.im), exp(z.re) * sin(z.im)}; }
static Double cosine_h(Double z) { return (Double){cosh(z.re) * cos(z.im), sinh(z.re) * sin(z.im)}; }
static Double sine_h(Double z) { return (Double){sinh(z.re) * cos(z.im), cosh(z.re) * sin(z.im)}; }
static Double tangent_h(Double z) {
    const double t = tanh(z.re), s = tan(z.im), below = 1.0 + t * t * s * s;
    return (Double){t * (1.0 + s * s) / below, s * (1.0 - t * t) / below};
}
static Double cosine(Double z) { return cosine_h(times_i(z)); }
static Double sine(Double z) { return over_i(sine_h(times_i(z))); }
static Double tangent(Double z) { return over_i(tangent_h(times_i(z))); }
static Double power(Double a, Double b) {
    const double r = log(absolute(a)), phi = argument(a);
    return exponential((Double){b.re * r - b.im * phi, b.re * phi + b.im * r});
}

#define REAL(name, function)                                                          \
    __declspec(dllexport) double stepdiag_##name(Double z) { return function(z); }    \
    __declspec(dllexport) double stepdiag_##name##l(Double z) { return function(z); } \
    __declspec(dllexport) float stepdiag_##name##f(Single z) { return (float)function((Double){z.re, z.im}); }
#define COMPLEX(name, function)                                                       \
    __declspec(dllexport) Double stepdiag_##name(Double z) { return function(z); }    \
    __declspec(dllexport) Double stepdiag_##name##l(Double z) { return function(z); } \
    __declspec(dllexport) Single stepdiag_##name##f(Single z) {                       \
        const Double value = function((Double){z.re, z.im});                          \
        return (Single){(float)value.re, (float)value.im};                            \
    }

REAL(cabs, absolute)
REAL(carg, argument)
REAL(cimag, imaginary_part)
REAL(creal, real_part)
COMPLEX(ccos, cosine)
COMPLEX(ccosh, cosine_h)
COMPLEX(cexp, exponential)
COMPLEX(csin, sine)
COMPLEX(csinh, sine_h)
COMPLEX(ctan, tangent)
COMPLEX(ctanh, tangent_h)

__declspec(dllexport) Double stepdiag_cpow(Double a, Double b) { return power(a, b); }
__declspec(dllexport) Double stepdiag_cpowl(Double a, Double b) { return power(a, b); }
__declspec(dllexport) Single stepdiag_cpowf(Single a, Single b) {
    const Double value = power((Double){a.re, a.im}, (Double){b.re, b.im});
    return (Single){(float)value.re, (float)value.im};
}
