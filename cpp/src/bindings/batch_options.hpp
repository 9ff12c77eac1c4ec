// Python arguments that select the method of batch evaluators.
#pragma once

#include <string>

#include "options.hpp"
#include "stepdiag/batch/batch_evaluator.hpp"

namespace stepdiag::bindings {

EvaluationMethod to_evaluation_method(const std::string& text);  // "conventional", ...
BatchOptions to_batch_options(const std::string& method, const AdjustmentOptions& adjustment);

}  // namespace stepdiag::bindings
