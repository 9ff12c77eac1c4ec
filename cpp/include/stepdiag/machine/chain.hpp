// Kinematic chain of a three-axis machine from workpiece w to tool t, in the notation of ISO 10791. In "[w X' b Y Z t]"
// the X axis carries the workpiece; Y and Z carry the tool. The axes may be in any order and the bed b in any place. A
// prime marks an axis between workpiece and bed.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "stepdiag/core/axis.hpp"

namespace stepdiag {

class Chain {
public:
    // Parses "[w X' b Y Z t]", or "wX'bYZt" for contexts that do not allow blanks. Throws InvalidArgument if a link is
    // missing, unknown or given twice, or if a prime is on the wrong side of b.
    static Chain parse(std::string_view text);

    const std::array<Axis, 3>& order() const { return order_; }  // from w to t
    bool carries_workpiece(Axis axis) const { return rank(axis) < axes_before_bed_; }
    bool is_after(Axis axis, Axis other) const { return rank(axis) > rank(other); }  // nearer to the tool
    std::string name() const;                                                        // "[w X' b Y Z t]"

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
