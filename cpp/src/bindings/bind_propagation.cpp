#include "bindings.hpp"
#include "stepdiag/uncertainty/propagation.hpp"

namespace stepdiag::bindings {
namespace {

Eigen::MatrixXd to_matrix(const ArrayLike& object, const char* name) {
    const DoubleArray array = DoubleArray::ensure(object);
    if (!array || array.ndim() != 2) {
        PyErr_Clear();
        throw InvalidArgument(std::string(name) + ": expected a matrix of numbers");
    }
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

template <class List>
void check_length(const List& list, std::size_t expected, const char* name) {
    if (std::size_t(list.size()) != expected)
        throw InvalidArgument(std::string(name) + ": expected " + std::to_string(expected) + ", got " +
                              std::to_string(list.size()));
}

using Texts = std::vector<std::string>;

Propagation propagate_linear(const ArrayLike& value, const ArrayLike& sensitivity, const ArrayLike& uncertainty,
                             const std::optional<ArrayLike>& degrees_of_freedom,
                             const std::optional<std::vector<int>>& estimates, const std::optional<Texts>& names,
                             const std::optional<Texts>& groups, const std::optional<Texts>& outputs,
                             const std::optional<ArrayLike>& correlation, bool covariance) {
    LinearModel model;
    model.value = to_vector(value, "value");
    model.sensitivity = to_matrix(sensitivity, "sensitivity");
    const Eigen::VectorXd u = to_vector(uncertainty, "standard_uncertainty");
    const std::size_t count = std::size_t(u.size());
    if (names) check_length(*names, count, "names");
    if (groups) check_length(*groups, count, "groups");
    if (estimates) check_length(*estimates, count, "estimates");
    if (outputs) check_length(*outputs, std::size_t(model.value.size()), "outputs");
    Eigen::VectorXd freedom = Eigen::VectorXd::Constant(u.size(), std::numeric_limits<double>::infinity());
    if (degrees_of_freedom) {
        freedom = to_vector(*degrees_of_freedom, "degrees_of_freedom");
        check_length(freedom, count, "degrees_of_freedom");
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::string name = names ? (*names)[i] : "x" + std::to_string(i);
        model.inputs.push_back({name, groups ? (*groups)[i] : name, u[Eigen::Index(i)], freedom[Eigen::Index(i)],
                                estimates ? (*estimates)[i] : -1});
    }
    for (Eigen::Index i = 0; i < model.value.size(); ++i)
        model.outputs.push_back({outputs ? (*outputs)[std::size_t(i)] : "y" + std::to_string(i), std::nan(""), "1"});
    if (correlation) model.correlation = to_matrix(*correlation, "correlation");
    py::gil_scoped_release release;
    return propagate(model, covariance);
}

}  // namespace

void bind_propagation(py::module_& m) {
    py::class_<Propagation>(
        m, "Propagation",
        "Uncertainty of outputs by the law of propagation (GUM, JCGM 100), native units; arrays in the order of "
        "`outputs`.")
        .def_readonly("outputs", &Propagation::outputs)
        .def_property_readonly(
            "value", [](const Propagation& p) { return to_numpy_vector(p.value); }, "(m,)")
        .def_property_readonly(
            "standard_uncertainty", [](const Propagation& p) { return to_numpy_vector(p.standard_uncertainty); },
            "(m,)")
        .def_property_readonly(
            "degrees_of_freedom", [](const Propagation& p) { return to_numpy_vector(p.degrees_of_freedom); },
            "(m,) effective ones by Welch and Satterthwaite (GUM G.4.1); NaN where that does not apply: correlated "
            "inputs with finite degrees of freedom contribute.")
        .def_property_readonly(
            "covariance",
            [](const Propagation& p) {
                return p.covariance.size() > 0 ? std::optional(to_numpy(p.covariance)) : std::nullopt;
            },
            "(m, m); None unless asked for.")
        .def_property_readonly(
            "budget",
            [](const Propagation& p) {
                std::map<std::string, DoubleArray> budget;
                for (std::size_t g = 0; g < p.groups.size(); ++g)
                    budget[p.groups[g]] = to_numpy_vector(p.budget.col(Eigen::Index(g)));
                return budget;
            },
            "group of inputs -> (m,) standard uncertainty of each output by that group alone; with between_groups, "
            "the squares sum to the square of standard_uncertainty.")
        .def_property_readonly(
            "between_groups", [](const Propagation& p) { return to_numpy_vector(p.between_groups); },
            "(m,) part of the variance by correlation between inputs of two groups.")
        .def_property_readonly(
            "inputs",
            [](const Propagation& p) {
                std::vector<std::string> names;
                for (const PropagatedInput& input : p.inputs) names.push_back(input.name);
                return names;
            },
            "Names of the inputs that are drawn once: columns of first_order and second_order.")
        .def_property_readonly(
            "first_order", [](const Propagation& p) { return to_numpy(p.first_order); },
            "(m, inputs) sensitivity x standard uncertainty.")
        .def_property_readonly(
            "second_order", [](const Propagation& p) { return to_numpy(p.second_order); },
            "(m, inputs) what the square of a deviation by the standard uncertainty does, (f(+u) + f(-u) - 2 f(0))/2; "
            "linear propagation leaves it out. 0 where not known.")
        .def(
            "expanded", [](const Propagation& p, double coverage) { return to_numpy_vector(p.expanded(coverage)); },
            py::arg("coverage") = 0.95,
            "(m,) U = t_p u, of degrees of freedom truncated to whole ones (GUM G.4.1, G.6.4). Raises InvalidArgument "
            "for a probability outside 0 .. 1.")
        .def_readonly(
            "knows_products", &Propagation::knows_products,
            "Whether strongest_product, product_variance and product_shift are known: of virtual calibrations "
            "with up to 120 inputs.")
        .def_property_readonly(
            "strongest_product",
            [](const Propagation& p) {
                std::vector<std::tuple<std::string, std::string, double>> products;
                for (const Propagation::Product& product : p.strongest_product) {
                    const bool is_any = product.first >= 0;
                    products.emplace_back(is_any ? p.inputs[std::size_t(product.first)].name : "",
                                          is_any ? p.inputs[std::size_t(product.second)].name : "", product.value);
                }
                return products;
            },
            "Of each output the two inputs whose product does most when both deviate by their standard uncertainty, "
            "and what it does; empty where not known.")
        .def_property_readonly(
            "product_variance", [](const Propagation& p) { return to_numpy_vector(p.product_variance); },
            "(m,) variance by products of two independent inputs; empty where not known.")
        .def_property_readonly(
            "product_shift", [](const Propagation& p) { return to_numpy_vector(p.product_shift); },
            "(m,) by how much products of correlated inputs shift the mean; empty where not known.")
        .def_property_readonly(
            "second_order_shift", [](const Propagation& p) { return to_numpy_vector(p.second_order_shift()); },
            "(m,) by how much squares of deviations, and products of correlated ones, shift the mean.")
        .def_property_readonly(
            "second_order_uncertainty",
            [](const Propagation& p) { return to_numpy_vector(p.second_order_uncertainty()); },
            "(m,) standard uncertainty with the squares and products of normal, independent inputs.");

    m.def("propagate_linear", &propagate_linear, py::arg("value"), py::arg("sensitivity"),
          py::arg("standard_uncertainty"), py::kw_only(), py::arg("degrees_of_freedom") = std::nullopt,
          py::arg("estimates") = std::nullopt, py::arg("names") = std::nullopt, py::arg("groups") = std::nullopt,
          py::arg("outputs") = std::nullopt, py::arg("correlation") = std::nullopt, py::arg("covariance") = false,
          "Cov(y) = C Cov(x) C^T with C = sensitivity (m, n), x of these standard uncertainties (n,), degrees of "
          "freedom (n,; none: infinite) and correlation (n, n; none: independent). estimates: a number for each input; "
          "those with the same number, 0 or more, have their standard uncertainty from one estimate, so that its "
          "degrees of freedom count once; -1: its own. groups: of the budget; none: each input by itself. Least "
          "squares is the case C = A+. Raises InvalidArgument for what makes no sense.");

    m.def(
        "propagate",
        [](const VirtualCalibrations& virtual_calibrations, const std::optional<Calibration>& calibration,
           bool covariance) {
            return calibration ? propagate(*calibration, virtual_calibrations, covariance)
                               : propagate(virtual_calibrations, covariance);
        },
        py::arg("virtual_calibrations"), py::arg("calibration") = std::nullopt, py::kw_only(),
        py::arg("covariance") = false, py::call_guard<py::gil_scoped_release>(),
        "Uncertainty of all outputs of virtual calibrations: every input by central differences of whole calibrations "
        "at its expectation plus and minus its standard uncertainty; reading noise by the evaluation's gain, with its "
        "real covariance. A t distribution counts with its scale and degrees of freedom (GUM 4.2.3). calibration: one "
        "from a measurement, evaluated with full_covariance; values are then its own, the group \"readings\" is its "
        "own covariance (noise, and set-ups that were solved for), and what the inputs of the virtual calibrations "
        "(same plan, head and evaluation) contribute is added; their reading noise is not. Raises InvalidArgument for "
        "a calibration of other parameters or nodes, and where a deviation leaves the evaluation without a result.");
}

}  // namespace stepdiag::bindings
