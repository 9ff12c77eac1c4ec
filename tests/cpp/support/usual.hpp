// The volume, chain and lines that most tests measure.
#pragma once

#include <initializer_list>
#include <vector>

#include "stepdiag/machine/chain.hpp"
#include "stepdiag/plan/plan.hpp"

namespace stepdiag::test {

inline std::vector<Line> lines(std::initializer_list<const char*> names) {
    std::vector<Line> lines;
    for (const char* name : names) lines.push_back(Line::parse(name));
    return lines;
}

inline const Eigen::Vector3d volume(800.0, 600.0, 500.0);
inline const Chain chain = Chain::parse("[w X' b Y Z t]");
inline const std::vector<Line> diagonals = lines({"ppp", "npp", "pnp", "nnp"});
inline const std::vector<Line> scale_lines = lines({"p00", "0p0", "00p"});

inline Plan plan(int steps) { return {volume, diagonals, steps, all_axes, scale_lines}; }

}  // namespace stepdiag::test
