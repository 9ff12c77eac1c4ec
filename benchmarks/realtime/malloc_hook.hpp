#pragma once

// Number of calls so far of malloc, calloc, realloc, their aligned variants, operator new (which calls malloc) and
// free.
long allocation_calls();
