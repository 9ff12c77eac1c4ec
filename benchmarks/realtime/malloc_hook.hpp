#pragma once

// Calls of malloc, calloc, realloc, their aligned kin, operator new (which calls malloc) and free up to now.
long allocation_calls();
