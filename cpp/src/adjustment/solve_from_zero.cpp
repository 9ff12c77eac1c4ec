#include "adjustment/solve_from_zero.hpp"

#include <algorithm>
#include <limits>

namespace stepdiag {

// What is open is assumed to be at 0 first, and then, because that pulls at what is determined by its square, where
// it came out.
std::optional<int> solve_from_zero(GaussNewton& solver, const std::vector<bool>& determined, Eigen::VectorXd& x,
                                   int most_steps) {
    // The second order of what is open may lead astray: then once more from zero with the open unknowns held, and
    // whichever fits best.
    constexpr double parts[] = {1.0, 1e-4};
    constexpr double good_fit = 4.0;
    const double readings = double(solver.equations().problem().readings().size());
    std::optional<int> count;
    double least = std::numeric_limits<double>::infinity();
    double best = parts[0];
    for (const double part : parts) {
        Eigen::VectorXd solution = Eigen::VectorXd::Zero(x.size());
        solver.equations().assume_usual(determined, solution, part);
        const std::optional<int> steps = solver.try_solve(solution, most_steps);
        const double square_sum = solver.equations().square_sum(solution);
        if (steps && square_sum < least) {
            count = steps;
            x = solution;
            least = square_sum;
            best = part;
        }
        if (solver.dependent().empty() || (count && least < good_fit * readings)) break;
    }
    if (!count || solver.dependent().empty() || best < 1.0) return count;
    Eigen::VectorXd again = x;
    solver.equations().assume_usual(determined, x);
    const std::optional<int> more = solver.try_solve(again, most_steps);
    // Once more may lead astray, too.
    if (!more || solver.equations().square_sum(again) > 1.01 * std::max(least, readings)) {
        solver.equations().assume_usual(determined, Eigen::VectorXd::Zero(x.size()));
        return count;
    }
    x = again;
    return *count + *more;
}

}  // namespace stepdiag
