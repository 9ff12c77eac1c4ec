// Kinematic chain of a three-axis machine in ISO 10791 style, from workpiece to tool: "[w X' b Y Z t]" has X carrying
// the workpiece, Y and Z the tool. Any order of the axes, the bed b anywhere; a prime marks an axis before the bed.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "stepdiag/core/axis.hpp"

namespace stepdiag {

class Chain {
public:
    // Parses "[w X' b Y Z t]" or, for places where no blank can stand, "wX'bYZt". Throws InvalidArgument when a link is
    // missing, doubled, or primed on the wrong side of b.
    static Chain parse(std::string_view text);

    const std::array<Axis, 3>& order() const { return order_; }  // from w to t
    bool carries_workpiece(Axis axis) const { return rank(axis) < axes_before_bed_; }
    bool is_after(Axis axis, Axis other) const { return rank(axis) > rank(other); }  // nearer to the tool
    std::string name() const;

    bool operator==(const Chain& other) const {
        return order_ == other.order_ && axes_before_bed_ == other.axes_before_bed_;
    }

private:
    Chain(std::array<Axis, 3> order, int axes_before_bed) : order_(order), axes_before_bed_(axes_before_bed) {}
    int rank(Axis axis) const;

    std::array<Axis, 3> order_;
    int axes_before_bed_;
};

}  // namespace stepdiag
