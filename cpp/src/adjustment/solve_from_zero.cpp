#include "adjustment/solve_from_zero.hpp"

#include <algorithm>
#include <limits>

namespace stepdiag {

// What is open is assumed to be at 0 first, and then, because that pulls at what is determined by its square, where
// it came out.
std::optional<int> solve_from_zero(GaussNewton& solver, const std::vector<bool>& determined, Eigen::VectorXd& x) {
    // The second order of what is open may lead astray: other ways from zero then, the last of them with the open
    // unknowns held, and whichever fits best.
    struct Way {
        double part;
        bool accelerated;
    };
    constexpr Way ways[] = {{1.0, true}, {1.0, false}, {1e-4, true}, {1e-4, false}};
    constexpr double good_fit = 4.0;
    const double readings = double(solver.equations().problem().readings().size());
    std::optional<int> count;
    double least = std::numeric_limits<double>::infinity();
    Way best = ways[0];
    for (const Way& way : ways) {
        Eigen::VectorXd solution = Eigen::VectorXd::Zero(x.size());
        solver.equations().assume_usual(determined, solution, way.part);
        const std::optional<int> steps = solver.try_solve(solution, GaussNewton::usual_most_steps, way.accelerated);
        const double square_sum = solver.equations().square_sum(solution);
        if (steps && square_sum < least) {
            count = steps;
            x = solution;
            least = square_sum;
            best = way;
        }
        if (solver.dependent().empty() || (count && least < good_fit * readings)) break;
    }
    if (!count || solver.dependent().empty() || best.part < 1.0) return count;
    Eigen::VectorXd again = x;
    solver.equations().assume_usual(determined, x);
    const std::optional<int> more = solver.try_solve(again);
    // Once more may lead astray, too.
    if (!more || solver.equations().square_sum(again) > 1.01 * std::max(least, readings)) {
        solver.equations().assume_usual(determined, Eigen::VectorXd::Zero(x.size()));
        return count;
    }
    x = again;
    return *count + *more;
}

}  // namespace stepdiag
