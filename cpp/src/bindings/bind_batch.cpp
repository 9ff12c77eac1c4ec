#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>

#include "batch_options.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "struct_table.hpp"

namespace stepdiag::bindings {
namespace {

// In Python, an evaluator knows the shape of a set of readings.
struct EvaluatorOfPattern {
    BatchEvaluator evaluator;
    std::size_t rows;
    std::vector<std::string> channels;

    std::size_t readings() const { return rows * channels.size(); }
};

std::vector<std::string> signal_names(const Measurement& measurement) {
    std::vector<std::string> names;
    for (const Channel& channel : measurement.channels())
        if (is_signal(channel.name)) names.push_back(channel.name);
    return names;
}

std::unique_ptr<EvaluatorOfPattern> make_evaluator(const Measurement& pattern, const Plan& plan, const HeadLike& heads,
                                                   const ChainLike& chain, const ArrayLike& tool,
                                                   const std::string& method,
                                                   const std::optional<AdjustmentOptions>& given,
                                                   const Fields& fields) {
    const BatchOptions options = to_batch_options(method, options_of(given, fields));
    const HeadCalibrations calibrations = to_heads(heads, plan).calibration();
    const Chain kinematics = to_chain(chain);
    const Eigen::Vector3d offset = to_vector3(tool, "tool");
    py::gil_scoped_release release;
    return std::make_unique<EvaluatorOfPattern>(
        EvaluatorOfPattern{BatchEvaluator(pattern, plan, kinematics, offset, calibrations, options), pattern.size(),
                           signal_names(pattern)});
}

// Evaluates the sets first ... first + lane_group - 1; places after the last set repeat the first one.
void evaluate_group(const EvaluatorOfPattern& of, BatchEvaluator::Worker& worker, std::size_t first,
                    const double* readings, std::size_t sets, double* values) {
    const std::size_t inputs = of.readings(), entries = of.evaluator.entries().size();
    std::vector<double> in(inputs * lane_group), out(entries * lane_group);
    const std::size_t count = std::min(lane_group, sets - first);
    for (std::size_t lane = 0; lane < lane_group; ++lane) {
        const double* set = readings + (first + (lane < count ? lane : 0)) * inputs;
        for (std::size_t i = 0; i < inputs; ++i) in[i * lane_group + lane] = set[i];
    }
    worker.evaluate(in.data(), lane_group, out.data(), lane_group);
    for (std::size_t lane = 0; lane < count; ++lane)
        for (std::size_t e = 0; e < entries; ++e) values[(first + lane) * entries + e] = out[e * lane_group + lane];
}

void evaluate_on_threads(const EvaluatorOfPattern& of, const double* readings, std::size_t sets, double* values,
                         unsigned threads) {
    std::atomic<std::size_t> next = 0;
    std::exception_ptr failure;
    std::mutex failing;
    const auto work = [&] {
        try {
            BatchEvaluator::Worker worker(of.evaluator);
            for (std::size_t first; (first = next.fetch_add(lane_group)) < sets;)
                evaluate_group(of, worker, first, readings, sets, values);
        } catch (...) {
            const std::lock_guard<std::mutex> lock(failing);
            failure = std::current_exception();
            next = sets;
        }
    };
    std::vector<std::thread> others;
    for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
    work();
    for (std::thread& thread : others) thread.join();
    if (failure) std::rethrow_exception(failure);
}

DoubleArray evaluate_runs(const EvaluatorOfPattern& of, const ArrayLike& readings, const IntegerLike& threads) {
    const DoubleArray array = DoubleArray::ensure(readings);
    if (!array || array.ndim() != 3 || std::size_t(array.shape(1)) != of.rows ||
        std::size_t(array.shape(2)) != of.channels.size()) {
        PyErr_Clear();
        throw InvalidArgument("readings: expected shape (n, " + std::to_string(of.rows) + ", " +
                              std::to_string(of.channels.size()) + "), got " +
                              (array ? std::string(py::str(py::object(array.attr("shape")))) : "no array of numbers"));
    }
    constexpr int most_threads = 1024;
    const std::size_t sets = std::size_t(array.shape(0)), groups = (sets + lane_group - 1) / lane_group;
    unsigned count = unsigned(to_integer(threads, "threads", 0, most_threads));
    if (count == 0) count = std::max(1u, std::thread::hardware_concurrency());
    count = unsigned(std::clamp<std::size_t>(groups, 1, count));
    DoubleArray values({array.shape(0), py::ssize_t(of.evaluator.entries().size())});
    double* const to = values.mutable_data();
    {
        py::gil_scoped_release release;
        evaluate_on_threads(of, array.data(), sets, to, count);
    }
    return values;
}

}  // namespace

EvaluationMethod to_evaluation_method(const std::string& text) {
    for (const auto& [name, method] :
         {std::pair("conventional", EvaluationMethod::conventional), std::pair("enhanced", EvaluationMethod::enhanced),
          std::pair("adjustment", EvaluationMethod::adjustment), std::pair("one_step", EvaluationMethod::one_step)})
        if (text == name) return method;
    throw InvalidArgument("method: expected \"conventional\", \"enhanced\", \"adjustment\" or \"one_step\", got \"" +
                          text + "\"");
}

BatchOptions to_batch_options(const std::string& method, const AdjustmentOptions& adjustment) {
    BatchOptions options;
    options.method = to_evaluation_method(method);
    options.uncertainty = adjustment.uncertainty;
    options.expansion = adjustment.expansion;
    options.adjustment = adjustment;
    return options;
}

void bind_batch(py::module_& m) {
    bind_record(m, "CalibrationEntry", "A value of a calibration's tables.",
                field("parameter", &CalibrationEntry::parameter, "\"EXX\", ..., \"C0Y\""),
                field("position", &CalibrationEntry::position, "mm; NaN for a squareness"))
        .def("__repr__", [](const CalibrationEntry& e) {
            return "CalibrationEntry(" + e.parameter +
                   (std::isnan(e.position) ? "" : ", " + std::string(py::str(py::float_(e.position))) + " mm") + ")";
        });

    using Evaluator = EvaluatorOfPattern;
    py::class_<Evaluator>(m, "BatchEvaluator",
                          "One evaluation of many sets of readings of the same plan, heads and pattern of readings; "
                          "what is known of the pattern serves all of them.")
        .def(
            py::init(&make_evaluator), py::arg("pattern"), py::arg("plan"), py::arg("heads"), py::arg("chain"),
            py::arg("tool") = zeros(3), py::kw_only(), py::arg("method") = "enhanced",
            py::arg("options") = std::nullopt,
            "pattern: a run whose readings are there; lost ones are not used in any set. method: \"conventional\", "
            "\"enhanced\", \"adjustment\" (each set converged to 1e-4 of its values' standard uncertainties, without a "
            "search for outliers) or \"one_step\" (the pattern's values plus gain times what differs: off by terms of "
            "second order). The options are AdjustmentOptions, or its fields by name: full_covariance and plausible "
            "concern "
            "the pattern alone, an outlier_probability other than 0 or the default and scale_uncertainty are refused; "
            "linear methods take the uncertainty alone. Raises InvalidArgument.")
        .def_property_readonly(
            "entries", [](const Evaluator& e) { return e.evaluator.entries(); },
            "The values that a set of readings gives: functions EXX ... ECZ, nodes ascending, then squarenesses.")
        .def_readonly("channels", &Evaluator::channels, "Of a set of readings.")
        .def_property_readonly(
            "calibration", [](const Evaluator& e) { return e.evaluator.of_pattern(); },
            "The evaluation of the pattern, with standard uncertainties.")
        .def("evaluate", &evaluate_runs, py::arg("readings"), py::arg("threads") = integer(0),
             "(n, entries), mm and rad, from readings (n, rows of the pattern, channels); NaN for a set with a lost "
             "reading or without a solution. A set gives the same bits whatever stands beside it. threads: 0 for all "
             "cores. Raises InvalidArgument.")
        .def(
            "gain",
            [](const Evaluator& e) {
                Eigen::MatrixXd gain;
                {
                    py::gil_scoped_release release;
                    gain = e.evaluator.gain();
                }
                return to_numpy(gain)
                    .attr("reshape")(py::make_tuple(gain.rows(), e.rows, e.channels.size()))
                    .cast<DoubleArray>();
            },
            "(entries, rows, channels): d value / d reading at the pattern.");
}

}  // namespace stepdiag::bindings
