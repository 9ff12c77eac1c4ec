// What evaluators of many sets of readings take beside the pattern.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "bindings.hpp"
#include "stepdiag/batch/batch_evaluator.hpp"

namespace stepdiag::bindings {

EvaluationMethod to_evaluation_method(const std::string& text);  // "conventional", ...
BatchOptions to_batch_options(const std::string& method, const ReadingUncertainty& uncertainty, const Priors& setup,
                              const std::map<std::string, Priors>& setup_by_line, bool one_setup_per_line,
                              bool reversal, bool rotations, const std::optional<Smoothness>& smoothness);

}  // namespace stepdiag::bindings
