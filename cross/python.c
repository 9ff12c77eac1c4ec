/* python.exe, which Panda3D's runtime does not bring. */
#include <wchar.h>

int Py_Main(int argc, wchar_t** argv);

int wmain(int argc, wchar_t** argv) { return Py_Main(argc, argv); }
