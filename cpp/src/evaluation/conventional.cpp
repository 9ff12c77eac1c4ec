#include "stepdiag/evaluation/conventional.hpp"
#include "stepdiag/core/error.hpp"
namespace stepdiag {
Calibration evaluate_conventional(const Measurement&, const Plan&, const Chain&, const Eigen::Vector3d&, const HeadCalibration&, const EvaluationOptions&) { throw InvalidArgument("being written"); }
}
