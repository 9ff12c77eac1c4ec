// Distance between bodies. Internal: not installed.
#pragma once

#include <vector>

#include "stepdiag/optics/body.hpp"

namespace stepdiag {

// Distance between two convex bodies or flat pieces (mirror, screen), mm; 0 if they touch or overlap. It is the
// distance between the convex hulls of all corners, so a face inside a body (the splitting face of a cube) has no
// influence. The result never exceeds the true distance and is smaller by at most 1e-12 of size and distance. The cost
// is about ten passes over all corners. Throws InvalidArgument for a body without corners, or with a corner that is not
// finite.
//
// Method: nearest point to 0 in the set of all differences a - b (P. Wolfe, "Finding the nearest point in a polytope",
// Mathematical Programming 11 (1976) 128).
double separation(const std::vector<Face>& a, const std::vector<Face>& b);

}  // namespace stepdiag
