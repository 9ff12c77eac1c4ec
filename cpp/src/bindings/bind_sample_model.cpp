#include <algorithm>

#include "bindings.hpp"
#include "stepdiag/core/random_blocks.hpp"
#include "stepdiag/monte_carlo/sample_model.hpp"

namespace stepdiag::bindings {
namespace {

// Whole groups of lanes, of which those asked for are copied.
DoubleArray evaluate(const SampleModel& model, std::uint64_t first_sample, std::size_t samples) {
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

void bind_sample_model(py::module_& m) {
    py::class_<SampleModel::Output>(m, "Output", "An output of a sample model. Native units.")
        .def_readonly("name", &SampleModel::Output::name)
        .def_readonly("position", &SampleModel::Output::position, "mm; NaN where it has none.")
        .def_readonly("unit", &SampleModel::Output::unit, "\"mm\", \"rad\", \"1\"")
        .def("__repr__", [](const SampleModel::Output& output) {
            return "Output(" + output.name + ", " + std::to_string(output.position) + ", " + output.unit + ")";
        });

    py::class_<SampleModel>(m, "SampleModel",
                            "A measurement model as the Monte Carlo method sees it (JCGM 101, 5.9): outputs of sample "
                            "after sample, each a pure function of the seed and the sample's index.")
        .def_property_readonly("outputs", &SampleModel::outputs)
        .def_property_readonly("seed", &SampleModel::seed)
        .def_property_readonly("target", &SampleModel::target,
                               "The instruction set, for which the bits of a sample are the same.")
        .def(
            "evaluate",
            [](const SampleModel& model, const IntegerLike& first_sample, const IntegerLike& samples) {
                const auto count = to_integer(samples, "samples", 0, std::int64_t(1) << 32);
                const auto first = to_integer(first_sample, "first_sample", 0, std::int64_t(1) << 62);
                return evaluate(model, std::uint64_t(first), std::size_t(count));
            },
            py::arg("first_sample"), py::arg("samples"),
            "Array (outputs, samples); NaN in all outputs of a sample that gave no result. Raises InvalidArgument.");
}

}  // namespace stepdiag::bindings
