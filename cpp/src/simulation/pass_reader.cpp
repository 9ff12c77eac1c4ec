#include "stepdiag/simulation/pass_reader.hpp"

#include <algorithm>
#include <sstream>

#include "stepdiag/core/error.hpp"

namespace stepdiag {
namespace {

double farthest_beam(const Head& head) {
    double farthest = 0.0;
    const auto include = [&](const Eigen::Vector2d& start) {
        farthest = std::max(farthest, start.lpNorm<Eigen::Infinity>());
    };
    if (head.design)
        for (const HeadBeam& beam : head.design->beams) include(beam.placement.position.head<2>());
    else
        for (const Eigen::Vector2d& offset : head.beam_offsets) include(offset);
    return farthest;
}

Eigen::Vector2d mirror_size(const Head& head, const Plan& plan) {
    const Eigen::Vector2d smallest = plan.smallest_mirror();
    if (!head.mirror) return smallest + Eigen::Vector2d::Constant(2.0 * (Head::mirror_margin + farthest_beam(head)));
    if ((*head.mirror - smallest).minCoeff() < 0.0) {
        std::ostringstream text;
        text << "head mirror: too small for this plan: expected at least " << smallest.x() << " x " << smallest.y()
             << " mm, got " << head.mirror->x() << " x " << head.mirror->y() << " mm";
        throw InvalidArgument(text.str());
    }
    return *head.mirror;
}

}  // namespace

LinePlace place_on_line(const Machine& machine, const Plan& plan, const Heads& heads, const Line& line) {
    const Head& head = heads.of(line);
    return {&head, plan.frame(line), plan.points(line).front().commanded + machine.tool(), mirror_size(head, plan)};
}

std::vector<Pose> tool_poses(const Machine& machine, const PlannedPass& pass, const SimulationOptions& options) {
    const Approaches approach = approaches(pass.line, pass.direction);
    std::vector<Pose> poses;
    for (const PlanPoint& point : pass.points)
        poses.push_back(
            machine.pose(point.commanded, approach, options.shift(point.commanded, pass.first_row + poses.size())));
    return poses;
}

PassReader::PassReader(Head head, const LinePlace& place, const Misalignment& misalignment,
                       const ReadingConditions& conditions, std::shared_ptr<const TracedReader> traced)
    : head_(std::move(head)),
      signals_(signal_names(head_)),
      misalignment_(misalignment),
      setup_(set_up(head_, place.frame, place.first_point, place.mirror, misalignment)),
      traced_(std::move(traced)) {
    if (head_.design) {
        if (!traced_) traced_ = std::make_shared<TracedReader>(head_, place.mirror, conditions);
        return;
    }
    for (Eigen::Vector2d& offset : head_.beam_offsets) offset *= 1.0 + misalignment.gain;
    index_ratio_ = refractive_index(conditions.environment, head_.wavelength) /
                   refractive_index(conditions.assumed.value_or(conditions.environment), head_.wavelength);
}

void PassReader::add_setup(SignalRow& row, double elapsed) const {
    for (std::size_t c = 0; c < row.size(); ++c) {
        if (!row[c]) continue;
        double constant = 0.0;
        if (is_distance(signals_[c])) {
            *row[c] *= index_ratio_;
            constant = misalignment_.distance_constant + misalignment_.drift * elapsed +
                       (c < misalignment_.beam_constants.size() ? misalignment_.beam_constants[c] : 0.0);
        } else {
            *row[c] *= 1.0 + misalignment_.gain;
            if (head_.layout == HeadLayout::psd) constant = misalignment_.psd_zero[signals_[c] == "spot_y"];
        }
        *row[c] += constant;
    }
}

std::vector<SignalRow> PassReader::read(const std::vector<Pose>& poses, const std::vector<double>& elapsed,
                                        std::uint64_t first_row, ReplayCount* count) const {
    std::vector<MirrorPose> mirrors;
    for (const Pose& pose : poses) mirrors.push_back(mirror(pose));
    std::vector<SignalRow> rows;
    if (traced_) rows = traced_->read(mirrors, first_row, count);
    else
        for (const MirrorPose& mirror : mirrors) rows.push_back(define_signals(head_, mirror, setup_.mirror));
    for (std::size_t k = 0; k < rows.size(); ++k) add_setup(rows[k], elapsed[k]);
    return rows;
}

}  // namespace stepdiag
