/* For tests alone: functions that Debian 12's Wine lacks, and packages call. */
#include <fenv.h>
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
