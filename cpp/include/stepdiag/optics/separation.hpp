// How far bodies stand apart.
#pragma once

#include <vector>

#include "stepdiag/optics/body.hpp"

namespace stepdiag {

// Distance of two convex bodies or flat pieces (mirror, screen), mm: of the convex hulls of all their faces' corners,
// so that a face inside a body, as a cube's splitting one, changes nothing. 0 where they touch or overlap. Never more
// than the true distance, and less by at most 1e-12 of their size and distance. Costs as much as looking at every
// corner some ten times. Throws InvalidArgument for a body without a corner, or one that is not finite.
//
// P. Wolfe, "Finding the nearest point in a polytope", Mathematical Programming 11 (1976) 128: the point of the set of
// all differences a - b that is nearest to 0.
double separation(const std::vector<Face>& a, const std::vector<Face>& b);

}  // namespace stepdiag
