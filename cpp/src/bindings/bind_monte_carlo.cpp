#include <pybind11/typing.h>

#include <algorithm>
#include <limits>

#include "bindings.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/monte_carlo/adaptive_procedure.hpp"
#include "stepdiag/monte_carlo/distribution.hpp"
#include "stepdiag/monte_carlo/function_model.hpp"
#include "stepdiag/monte_carlo/monte_carlo.hpp"
#include "stepdiag/monte_carlo/sample_model.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

using Progress = std::optional<py::typing::Callable<py::object(std::uint64_t)>>;
using ModelFunction = py::typing::Callable<py::object(DoubleArray)>;
using Correlation = std::pair<std::vector<int>, ArrayLike>;

// The calling thread polls this without the interpreter lock. Ctrl-C ends a run even if nobody watches its progress.
RunControl to_control(const IntegerLike& threads, const Progress& progress) {
    return {to_int(threads, "threads"), [&progress](std::uint64_t leaves_done) {
                const py::gil_scoped_acquire lock;
                if (PyErr_CheckSignals() != 0) throw py::error_already_set();
                if (!progress) return true;
                const py::object answer = (*progress)(leaves_done);
                return answer.is_none() || answer.cast<bool>();
            }};
}

std::uint64_t to_leaf(const IntegerLike& number, const char* name) {
    return std::uint64_t(to_integer(number, name, 0, std::int64_t(largest_leaf_count)));
}

// Worker threads call a Python function one after another, each with the interpreter lock.
FunctionModel::Function to_function(const ModelFunction& function) {
    // The last reference may be dropped by a thread that does not hold the lock.
    const std::shared_ptr<py::function> shared(new py::function(function), [](py::function* held) {
        const py::gil_scoped_acquire lock;
        delete held;
    });
    return [shared](Eigen::Ref<const FunctionModel::Values> inputs, Eigen::Ref<FunctionModel::Values> outputs) {
        const py::gil_scoped_acquire lock;
        DoubleArray arguments({inputs.rows(), inputs.cols()});
        Eigen::Map<FunctionModel::Values>(arguments.mutable_data(), inputs.rows(), inputs.cols()) = inputs;
        const py::object result = (*shared)(arguments);
        const DoubleArray values = DoubleArray::ensure(result);
        if (!values) PyErr_Clear();
        const bool row = values && values.ndim() == 1 && outputs.rows() == 1 && values.shape(0) == outputs.cols();
        if (!row &&
            !(values && values.ndim() == 2 && values.shape(0) == outputs.rows() && values.shape(1) == outputs.cols()))
            throw InvalidArgument("function: expected an array of shape (" + std::to_string(outputs.rows()) + ", " +
                                  std::to_string(outputs.cols()) + ") back, got " +
                                  (values ? "shape " + std::string(py::str(py::object(values.attr("shape"))))
                                          : std::string(py::str(py::type::handle_of(result)))));
        outputs = Eigen::Map<const FunctionModel::Values>(values.data(), outputs.rows(), outputs.cols());
    };
}

std::vector<SampleModel::Output> to_outputs(const std::vector<std::string>& names) {
    std::vector<SampleModel::Output> outputs;
    for (const std::string& name : names) outputs.push_back({name, std::numeric_limits<double>::quiet_NaN(), "1"});
    return outputs;
}

DoubleArray to_flags(const JointRegion& region) {
    std::vector<py::ssize_t> shape(region.cells.begin(), region.cells.end());
    DoubleArray flags(shape);
    std::copy(region.smallest.begin(), region.smallest.end(), flags.mutable_data());
    return flags;
}

const char* figure_name(Stability::Figure figure) {
    constexpr const char* names[] = {"mean", "standard uncertainty", "lower end", "upper end"};
    return names[int(figure)];
}

void bind_statistics(py::module_& m) {
    m.attr("leaf_samples") = leaf_samples;
    m.attr("pilot_samples") = pilot_samples;
    bind_options<StatisticsOptions>(
        m, "StatisticsOptions", "What a Monte Carlo run is to find out of its samples. make_bins checks it.", nullptr,
        field("coverage", &StatisticsOptions::coverage, "Of intervals."),
        field("digits", &StatisticsOptions::digits,
              "Of standard uncertainties that matter, 1 to 3; bins are a fifth of delta wide (JCGM 101, 7.9.2)."),
        field("covariance", &StatisticsOptions::covariance, "Of all outputs."),
        field("kept", &StatisticsOptions::kept, "Outputs of which every value is kept, 8 bytes each."),
        field("joint", &StatisticsOptions::joint,
              "Sets of one to three outputs that get joint coverage regions (JCGM 102, 6.5)."));
    m.def("numerical_tolerance", &numerical_tolerance, py::arg("standard_uncertainty"), py::arg("digits"),
          "delta = 10^r / 2 for u = c 10^r, c a whole number of so many digits (JCGM 101, 7.9.2).");

    py::class_<Bins>(m, "Bins", "What all parts of one Monte Carlo run share, fixed by its pilot run.")
        .def_property_readonly("outputs", &Bins::outputs)
        .def_property_readonly("options", &Bins::options)
        .def_property_readonly("seed", &Bins::seed)
        .def_property_readonly("target", &Bins::target)
        .def_property_readonly("counts", &Bins::counts, "Bins of all outputs: 6 bytes each, for every thread.")
        .def("to_bytes", [](const Bins& bins) { return py::bytes(bins.to_bytes()); })
        .def_static(
            "from_bytes", [](const py::bytes& bytes) { return Bins::from_bytes(std::string_view(bytes)); },
            py::arg("bytes"), "Raises InvalidArgument for damaged bytes.");
}

void bind_result(py::module_& m) {
    bind_record(
        m, "JointRegion",
        "A region of up to three outputs that holds the coverage (JCGM 102, 6.5): an ellipsoid and a rectangle about "
        "the pilot run's mean, of its covariance's shape, and the smallest region made of cells of a grid.",
        field("outputs", &JointRegion::outputs), field("centre", &JointRegion::centre),
        field("covariance", &JointRegion::covariance),
        field("ellipsoid_factor", &JointRegion::ellipsoid_factor,
              "k_p: (y - centre) covariance^-1 (y - centre) <= k_p^2; nan for a singular covariance"),
        field("rectangle_factor", &JointRegion::rectangle_factor, "k_q: |y_j - centre_j| <= k_q u_j"),
        field("ellipsoid_volume", &JointRegion::ellipsoid_volume),
        field("rectangle_volume", &JointRegion::rectangle_volume), field("grid_from", &JointRegion::grid_from),
        field("grid_width", &JointRegion::grid_width), field("smallest_volume", &JointRegion::smallest_volume),
        field("smallest_share", &JointRegion::smallest_share, "of all samples"))
        .def_property_readonly("smallest", &to_flags, "1 for each cell of the grid that is in the smallest region");

    bind_record(m, "Stability", "How far an adaptive procedure is from its end.", field("blocks", &Stability::blocks),
                field("ratio", &Stability::ratio,
                      "Twice the standard deviation of the average over blocks by delta, the largest of all."),
                field("output", &Stability::output),
                field("unstable", &Stability::unstable, "Outputs with a ratio above 1."))
        .def_property_readonly("figure", [](const Stability& s) { return figure_name(s.figure); })
        .def_property_readonly("stable", &Stability::stable);
    bind_record(m, "MonteCarloResult", "Figures of every output. Native units.",
                field("outputs", &MonteCarloResult::outputs, "With name, position (mm) and unit."),
                field("options", &MonteCarloResult::options, "The StatisticsOptions of the run."),
                field("seed", &MonteCarloResult::seed, "Of the random numbers."),
                field("target", &MonteCarloResult::target, "The instruction set: the same bits for the same one."),
                field("samples", &MonteCarloResult::samples, "Samples that gave a result."),
                field("lost", &MonteCarloResult::lost, "Samples that gave none: left out."),
                field("mean", &MonteCarloResult::mean, "(outputs,)"),
                field("standard_uncertainty", &MonteCarloResult::standard_uncertainty),
                field("symmetric", &MonteCarloResult::symmetric,
                      "(outputs, 2): ends of the probabilistically symmetric coverage intervals"),
                field("shortest", &MonteCarloResult::shortest, "(outputs, 2): ends of the shortest coverage intervals"),
                field("lowest", &MonteCarloResult::lowest, "(outputs,) of all samples"),
                field("highest", &MonteCarloResult::highest, "(outputs,) of all samples"),
                field("outside", &MonteCarloResult::outside,
                      "Values beyond the bins, by output: an interval's end among them is known roughly."),
                field("joint", &MonteCarloResult::joint, "A JointRegion for each group that was asked for."),
                field("stability", &MonteCarloResult::stability, "Of an adaptive run; else None."))
        .def_property_readonly("covariance",
                               [](const MonteCarloResult& r) {
                                   return r.covariance ? std::optional(to_numpy(*r.covariance)) : std::nullopt;
                               })
        .def_property_readonly(
            "kept",
            [](const MonteCarloResult& r) {
                std::map<std::size_t, DoubleArray> kept;
                for (const auto& [output, values] : r.kept) kept.emplace(output, to_numpy(values));
                return kept;
            },
            "Values by output, in the order of samples; nan for a lost one.");
}

void bind_parts(py::module_& m) {
    py::class_<PartialStatistics>(m, "PartialStatistics", "Statistics of a set of leaves of 2,000 samples.")
        .def(py::init<const Bins&>(), py::arg("bins"), "Of no leaves.")
        .def_property_readonly("bins", &PartialStatistics::bins)
        .def_property_readonly("leaves", &PartialStatistics::leaves, "Half-open ranges, ascending.")
        .def_property_readonly("samples", &PartialStatistics::samples)
        .def_property_readonly("lost", &PartialStatistics::lost)
        .def("merge", &PartialStatistics::merge, py::arg("other"), py::call_guard<py::gil_scoped_release>(),
             "Raises InvalidArgument for statistics of another run, saying in what, and for leaves that are in both.")
        .def(
            "run",
            [](PartialStatistics& all, const SampleModel& model, const IntegerLike& first_leaf,
               const IntegerLike& leaves, const IntegerLike& threads, const Progress& progress) {
                const RunControl control = to_control(threads, progress);
                const std::uint64_t first = to_leaf(first_leaf, "first_leaf"), count = to_leaf(leaves, "leaves");
                const py::gil_scoped_release release;
                add_leaves(all, model, first, count, control);
            },
            py::arg("model"), py::arg("first_leaf"), py::arg("leaves"), py::kw_only(), py::arg("threads") = integer(0),
            py::arg("progress") = std::nullopt,
            "Adds these leaves, as run_leaves computes them. Those that are done stay also where progress ends the "
            "run, by False or by an exception. progress may not use these statistics.")
        .def("result", &PartialStatistics::result, py::call_guard<py::gil_scoped_release>())
        .def("to_bytes", [](const PartialStatistics& part) { return py::bytes(part.to_bytes()); })
        .def_static(
            "from_bytes", [](const py::bytes& bytes) { return PartialStatistics::from_bytes(std::string_view(bytes)); },
            py::arg("bytes"), "Raises InvalidArgument for damaged bytes.");

    py::class_<AdaptiveProcedure>(
        m, "AdaptiveProcedure",
        "JCGM 101, 7.9.4: blocks of M samples until mean, standard uncertainty and both ends of the symmetric interval "
        "of every output are stable to delta.")
        .def(py::init<const Bins&>(), py::arg("bins"))
        .def_static("leaves_per_block", &AdaptiveProcedure::leaves_per_block, py::arg("coverage"))
        .def_property_readonly("next_block", &AdaptiveProcedure::next_block, "Its leaves, half-open.")
        .def_property_readonly("blocks", &AdaptiveProcedure::blocks)
        .def("add", &AdaptiveProcedure::add, py::arg("block"), py::arg("all"),
             "The next block, which is also merged into `all`. Raises InvalidArgument for what is not the next block.")
        .def("stability", &AdaptiveProcedure::stability, py::arg("all"), "all: the statistics of all blocks so far.")
        .def("result", &AdaptiveProcedure::result, py::arg("all"), "That of `all`, with its stability.")
        .def("to_bytes", [](const AdaptiveProcedure& procedure) { return py::bytes(procedure.to_bytes()); })
        .def_static(
            "from_bytes", [](const py::bytes& bytes) { return AdaptiveProcedure::from_bytes(std::string_view(bytes)); },
            py::arg("bytes"), "Raises InvalidArgument for damaged bytes.");
}

void bind_runs(py::module_& m) {
    m.def(
        "make_bins",
        [](const SampleModel& model, const StatisticsOptions& options, const IntegerLike& threads) {
            const Progress none;
            const RunControl control = to_control(threads, none);
            const py::gil_scoped_release release;
            return make_bins(model, options, control);
        },
        py::arg("model"), py::arg("options") = StatisticsOptions{}, py::arg("threads") = integer(0),
        "The pilot run over the first 10,000 samples. threads: 0 takes all processors. Raises InvalidArgument.");
    m.def(
        "run_leaves",
        [](const SampleModel& model, const Bins& bins, const IntegerLike& first_leaf, const IntegerLike& leaves,
           const IntegerLike& threads, const Progress& progress) {
            const RunControl control = to_control(threads, progress);
            const std::uint64_t first = to_leaf(first_leaf, "first_leaf"), count = to_leaf(leaves, "leaves");
            const py::gil_scoped_release release;
            return run_leaves(model, bins, first, count, control);
        },
        py::arg("model"), py::arg("bins"), py::arg("first_leaf"), py::arg("leaves"), py::kw_only(),
        py::arg("threads") = integer(0), py::arg("progress") = std::nullopt,
        "Statistics of these leaves; the bits depend on nothing else. progress(leaves_done) is called some times a "
        "second; False ends the run with the leaves that are done, an exception ends it at once and comes through. "
        "Raises "
        "InvalidArgument for a model that is not that of the bins.");
    m.def(
        "run_ranges",
        [](const SampleModel& model, const Bins& bins, const std::vector<LeafRange>& ranges, const IntegerLike& threads,
           const Progress& progress) {
            const RunControl control = to_control(threads, progress);
            const py::gil_scoped_release release;
            return run_ranges(model, bins, ranges, control);
        },
        py::arg("model"), py::arg("bins"), py::arg("ranges"), py::kw_only(), py::arg("threads") = integer(0),
        py::arg("progress") = std::nullopt,
        "The same for half-open ranges of leaves, each computed by one thread; those that are whole.");
}

}  // namespace

// --- sample models and distributions ---

namespace {

// Evaluates whole groups of lanes, and copies the samples that were asked for.
DoubleArray evaluate_samples(const SampleModel& model, std::uint64_t first_sample, std::size_t samples) {
    constexpr std::size_t at_a_time = 64 * lane_group;
    const std::size_t outputs = model.outputs().size();
    DoubleArray result({py::ssize_t(outputs), py::ssize_t(samples)});
    double* const to = result.mutable_data();
    py::gil_scoped_release release;
    const auto worker = model.worker();
    std::vector<double> values;
    for (std::size_t done = 0; done < samples;) {
        const std::uint64_t first = first_sample + done, aligned = first - first % lane_group;
        const std::size_t before = std::size_t(first - aligned);
        const std::size_t wanted = std::min(samples - done, at_a_time - before);
        const std::size_t whole = (before + wanted + lane_group - 1) / lane_group * lane_group;
        values.resize(outputs * whole);
        worker->evaluate({aligned, whole, values.data()});
        for (std::size_t i = 0; i < outputs; ++i)
            std::copy_n(&values[i * whole + before], wanted, to + i * samples + done);
        done += wanted;
    }
    return result;
}

}  // namespace

static void bind_sample_model(py::module_& m) {
    bind_record(m, "Output", "An output of a sample model. Native units.", field("name", &SampleModel::Output::name),
                field("position", &SampleModel::Output::position, "mm; NaN where it has none."),
                field("unit", &SampleModel::Output::unit, "\"mm\", \"rad\", \"1\""))
        .def("__repr__", [](const SampleModel::Output& output) {
            return "Output(" + output.name + ", " + std::to_string(output.position) + ", " + output.unit + ")";
        });

    py::class_<SampleModel>(m, "SampleModel",
                            "A measurement model as the Monte Carlo method sees it (JCGM 101, 5.9): outputs of sample "
                            "after sample, each a pure function of the seed and the sample's index.")
        .def_property_readonly("outputs", &SampleModel::outputs, "With name, position (mm) and unit.")
        .def_property_readonly("seed", &SampleModel::seed, "Of the random numbers.")
        .def_property_readonly("target", &SampleModel::target,
                               "The instruction set, for which the bits of a sample are the same.")
        .def(
            "evaluate",
            [](const SampleModel& model, const IntegerLike& first_sample, const IntegerLike& samples) {
                const auto count = to_integer(samples, "samples", 0, std::int64_t(1) << 32);
                const auto first = to_integer(first_sample, "first_sample", 0, std::int64_t(1) << 62);
                return evaluate_samples(model, std::uint64_t(first), std::size_t(count));
            },
            py::arg("first_sample"), py::arg("samples"),
            "Array (outputs, samples); NaN in all outputs of a sample that gave no result. Raises InvalidArgument.");
}

void bind_monte_carlo(py::module_& m) {
    bind_sample_model(m);
    py::class_<Distribution>(
        m, "Distribution",
        "A distribution that JCGM 101 (6.4) assigns to an input quantity: \"normal\" (spread: standard deviation), "
        "\"rectangular\", \"triangular\", \"arcsine\" (half width), \"t\" (scale; degrees_of_freedom), "
        "\"curvilinear_trapezoid\" (half width, known to plus and minus edge only).")
        .def(py::init([](const std::string& kind, double spread, double expectation, double degrees_of_freedom,
                         double edge) {
                 const Distribution distribution{parse_distribution_kind(kind), expectation, spread, degrees_of_freedom,
                                                 edge};
                 check(distribution, kind);
                 return distribution;
             }),
             py::arg("kind") = name(DistributionKind::normal), py::kw_only(), py::arg("spread"),
             py::arg("expectation") = Distribution{}.expectation,
             py::arg("degrees_of_freedom") = Distribution{}.degrees_of_freedom, py::arg("edge") = Distribution{}.edge,
             "degrees_of_freedom of a kind other than t: those of its standard uncertainty (GUM G.4). Raises "
             "InvalidArgument for a spread below 0, an edge not between 0 and the half width, degrees of freedom not "
             "above 0 (t: 2).")
        .def_property_readonly("kind", [](const Distribution& d) { return name(d.kind); })
        .def_readonly("expectation", &Distribution::expectation, "In the unit of the input.")
        .def_readonly("spread", &Distribution::spread)
        .def_readonly("degrees_of_freedom", &Distribution::degrees_of_freedom)
        .def_readonly("edge", &Distribution::edge)
        .def_property_readonly("standard_uncertainty", &Distribution::standard_uncertainty,
                               "In the unit of the input.");

    m.def("normal_quantile", &normal_quantile, py::arg("probability"),
          "The number that a standard normal number is below with this probability. Raises InvalidArgument.");
    m.def("t_quantile", &t_quantile, py::arg("probability"), py::arg("degrees_of_freedom"),
          "The same of Student's t distribution (coverage factors, GUM G.3). Raises InvalidArgument.");

    py::class_<FunctionModel, SampleModel>(m, "FunctionModel", "A model given as a function of its inputs.")
        .def(py::init([](const ModelFunction& function, std::vector<Distribution> distributions,
                         const std::vector<std::string>& outputs, const IntegerLike& seed,
                         const std::vector<Correlation>& correlations) {
                 std::vector<CorrelatedInputs> correlated;
                 for (const auto& [members, matrix] : correlations)
                     correlated.push_back({members, to_matrix(matrix, "correlation")});
                 return FunctionModel(to_function(function), std::move(distributions), to_outputs(outputs),
                                      to_seed(seed), std::move(correlated));
             }),
             py::arg("function"), py::arg("distributions"), py::arg("outputs"), py::kw_only(),
             py::arg("seed") = integer(0), py::arg("correlations") = std::vector<Correlation>{},
             "function: takes an (inputs, n) array, gives an (outputs, n) array; a sample with a value that is not "
             "finite is lost. correlations: pairs of indices of normal inputs and their correlation matrix. Raises "
             "InvalidArgument.");
    bind_statistics(m);
    bind_result(m);
    bind_parts(m);
    bind_runs(m);
}
}  // namespace stepdiag::bindings
