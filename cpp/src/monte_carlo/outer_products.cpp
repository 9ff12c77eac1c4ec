#include "monte_carlo/outer_products.hpp"

#include <algorithm>

#include "core/block_product.hpp"

namespace stepdiag {

Eigen::MatrixXd outer_products(const double* values, std::size_t stride, std::size_t samples,
                               const Eigen::VectorXd& mean) {
    constexpr Eigen::Index panel = 48;           // columns at once, a multiple of 6
    constexpr std::size_t samples_at_once = 96;  // deviations of 900 outputs stay in a core's second cache
    const Eigen::Index outputs = mean.size();
    const Eigen::Index columns = (outputs + panel - 1) / panel * panel;
    const Eigen::Index rows = columns + widest_vector;  // vectors reach beyond the last output: zeros
    Eigen::MatrixXd deviations = Eigen::MatrixXd::Zero(rows, Eigen::Index(samples_at_once));
    Eigen::MatrixXd products = Eigen::MatrixXd::Zero(rows, columns);
    for (std::size_t done = 0; done < samples; done += samples_at_once) {
        const Eigen::Index inner = Eigen::Index(std::min(samples_at_once, samples - done));
        for (Eigen::Index i = 0; i < outputs; ++i) {
            const double* value = values + std::size_t(i) * stride + done;
            for (Eigen::Index s = 0; s < inner; ++s) deviations(i, s) = value[s] - mean[i];
        }
        for (Eigen::Index j = 0; j < outputs; j += panel) {
            const double* from = deviations.data() + j;
            subtract_product(outputs - j, panel, inner, {from, rows}, {from, 1, rows},
                             {products.data() + j + j * rows, rows});
        }
    }
    Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(outputs, outputs);
    sums.triangularView<Eigen::Lower>() = -products.topLeftCorner(outputs, outputs);
    return sums;
}

}  // namespace stepdiag
