// Runs of a small plan with each kind of head, for tests of virtual calibrations.
#pragma once

#include <string>
#include <vector>

#include "head/head_designs.hpp"
#include "stepdiag/uncertainty/virtual_calibration.hpp"

namespace stepdiag::test {

enum class Kind { ideal, psd, psd_traced, multi_beam, multi_beam_traced };
inline const std::vector<Kind> all_kinds = {Kind::ideal, Kind::psd, Kind::psd_traced, Kind::multi_beam,
                                            Kind::multi_beam_traced};

inline Head head_of(Kind kind) {
    Head head;
    switch (kind) {
        case Kind::ideal: break;
        case Kind::psd:
            head.layout = HeadLayout::psd;
            head.psd_distance = 50.0;
            break;
        case Kind::psd_traced: return make_head(beam_and_psd(), 100.0);
        case Kind::multi_beam:
            head.layout = HeadLayout::multi_beam;
            head.beam_offsets = {{0.0, 0.0}, {20.0, 0.0}, {0.0, 20.0}};
            break;
        case Kind::multi_beam_traced: return make_head(three_beams(), 100.0);
    }
    return head;
}

inline VirtualRun run_of(Kind kind, int steps = 3) {
    const Eigen::Vector3d volume(800.0, 600.0, 500.0);
    RandomErrorMap errors;
    errors.seed = 4;
    const Heads heads(head_of(kind));
    return {Machine(Chain::parse("[w X' b Y Z t]"), make_random_error_map(volume, errors), {5.0, -3.0, 70.0}),
            Plan(volume, {Line::parse("ppp"), Line::parse("npp"), Line::parse("pnp"), Line::parse("nnp")}, steps,
                 all_axes, {Line::parse("p00"), Line::parse("0p0"), Line::parse("00p")}),
            heads,
            heads.calibration(),
            {},
            {},
            2.0};
}

inline UncertainInput normal(InputQuantity quantity, double spread, const std::string& line = "",
                             const std::string& part = "", int component = 0) {
    return {quantity, {DistributionKind::normal, 0.0, spread}, line, part, component};
}

}  // namespace stepdiag::test
