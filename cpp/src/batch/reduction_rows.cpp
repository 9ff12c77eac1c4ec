
#include "batch/batch_method.hpp"
#include "evaluation/linear_evaluation.hpp"
#include "batch/simd_reduction.hpp"
#include "evaluation/measurement_rows.hpp"

namespace stepdiag {
namespace {

// Finds the raw channels of a row that was read.
class RawPlaces {
public:
    explicit RawPlaces(const Measurement& pattern) : pattern_(pattern), signals_(signal_channels(pattern)) {}

    std::size_t channels() const { return signals_.size(); }
    std::optional<std::uint32_t> of(const std::string& channel, std::size_t row) const {
        for (std::size_t c = 0; c < signals_.size(); ++c) {
            const Channel& signal = pattern_.channels()[signals_[c]];
            if (signal.name == channel && signal.value[row]) return std::uint32_t(row * signals_.size() + c);
        }
        return std::nullopt;
    }

private:
    const Measurement& pattern_;
    std::vector<int> signals_;
};

// Raw channels of one row as visits.cpp takes them; `raws` empty where the reading is lost.
struct TakenRow {
    ReducedRow::Kind kind = ReducedRow::distance;
    std::vector<std::uint32_t> raws = {};
    std::vector<double> solution = {};
};

TakenRow take_beams(const RawPlaces& places, int beams, std::size_t row, const HeadCalibration& head) {
    TakenRow taken{ReducedRow::beams};
    std::vector<Eigen::Vector2d> offsets;
    for (int i = 0; i < beams; ++i)
        if (const auto raw = places.of("d" + std::to_string(i + 1), row)) {
            taken.raws.push_back(*raw);
            offsets.push_back(head.beam_offsets[i]);
        }
    // Where all beams are equally long the solution's derivatives are its coefficients.
    const auto reduced = reduce_beams(Eigen::VectorXd::Zero(Eigen::Index(offsets.size())), offsets);
    if (!reduced) return {};
    taken.solution.assign(reduced->jacobian.data(), reduced->jacobian.data() + reduced->jacobian.size());
    return taken;
}

TakenRow take_row(const Measurement& pattern, const RawPlaces& places, std::size_t row, const HeadCalibration& head,
                  LengthKind kind) {
    if (const int beams = pattern.beam_count()) return take_beams(places, beams, row, head);
    const auto distance = places.of("distance", row);
    if (kind == LengthKind::distance) return distance ? TakenRow{ReducedRow::distance, {*distance}} : TakenRow{};
    const bool has_spots = pattern.find("spot_x");
    const auto first = places.of(has_spots ? "spot_x" : "alpha", row);
    const auto second = places.of(has_spots ? "spot_y" : "beta", row);
    if (distance && first && second)
        return {has_spots ? ReducedRow::spot : ReducedRow::distance_and_tilts, {*distance, *first, *second}};
    if (distance) return {ReducedRow::distance, {*distance}};
    if (first && second && !has_spots) return {ReducedRow::tilts, {*first, *second}};
    return {};
}

}  // namespace

LaneReduction::LaneReduction(const Measurement& pattern, const HeadCalibrations& heads,
                             const std::vector<Visit>& visits, LengthKind kind) {
    const RawPlaces places(pattern);
    const auto rows = rows_by_visit(pattern);
    auto members = rows.begin();
    for (const Visit& visit : visits) {
        for (const std::size_t row : (members++)->second) {
            const int number = pattern.stations()[row].point;
            const VisitPoint& point = visit.points[number];
            const HeadCalibration& head = heads.of(visit.line.name());
            const TakenRow taken = take_row(pattern, places, row, head, kind);
            if (taken.raws.empty() || (taken.kind == ReducedRow::distance && !point.has_length)) continue;
            ReducedRow reduced{};
            reduced.kind = taken.kind;
            reduced.raws = std::uint32_t(taken.raws.size());
            reduced.place = std::uint32_t(values_per_reading * (visit.first_reading + number));
            reduced.by_distance_alone = kind == LengthKind::distance;
            reduced.lateral_x = point.lateral.x(), reduced.lateral_y = point.lateral.y();
            reduced.travel = visit.direction().dot(point.plan.commanded - visit.points.front().plan.commanded);
            reduced.psd_distance = head.psd_distance.value_or(0.0);
            reduced.spot_beam_x = head.spot_beam.x(), reduced.spot_beam_y = head.spot_beam.y();
            reduced.is_beside = !head.spot_beam.isZero(0.0);
            rows_.push_back(reduced);
            raws_.insert(raws_.end(), taken.raws.begin(), taken.raws.end());
            solutions_.insert(solutions_.end(), taken.solution.begin(), taken.solution.end());
        }
    }
}

}  // namespace stepdiag
