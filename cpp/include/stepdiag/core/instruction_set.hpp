// The instruction set of the processor that everything with several lanes is calculated with.
#pragma once

#include <string>
#include <vector>

namespace stepdiag {

// Name of the instruction set in use, e.g. "AVX3" (AVX-512); results are the same bits for the same one.
std::string instruction_set();
// Those that this processor has, fastest first. The fastest is in use until another is chosen, for the whole process,
// e.g. to get the bits of a lesser processor. Throws InvalidArgument naming those there are.
std::vector<std::string> instruction_sets();
void choose_instruction_set(const std::string& name);

}  // namespace stepdiag
