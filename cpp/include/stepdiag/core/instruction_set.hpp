// Selects the SIMD instruction set of the processor for all vectorised calculations.
#pragma once

#include <string>
#include <vector>

namespace stepdiag {

// Name of the instruction set in use, such as "AVX3" (AVX-512). The same instruction set gives the same bits.
std::string instruction_set();
// Instruction sets that this processor supports, fastest first. The fastest is the default.
std::vector<std::string> instruction_sets();
// Selects an instruction set for the whole process, for example to reproduce the bits of an older processor. Throws
// InvalidArgument, which lists the supported ones, for any other name.
void choose_instruction_set(const std::string& name);

}  // namespace stepdiag
