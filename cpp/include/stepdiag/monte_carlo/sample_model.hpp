// Interface of a measurement model for the Monte Carlo method (JCGM 101:2008, 5.9). The outputs of a sample are a pure
// function of the seed and the index of the sample.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stepdiag {

// Outputs of a block of samples. Rows are outputs, columns are samples; the samples of a row are contiguous.
struct SampleBlock {
    std::uint64_t first_sample;  // a multiple of lane_group
    std::size_t samples;         // a multiple of lane_group
    double* outputs;             // outputs[output * samples + sample]; all outputs of a sample without a result are NaN

    double* output(std::size_t index) const { return outputs + index * samples; }
};

class SampleModel {
public:
    virtual ~SampleModel() = default;

    struct Output {
        std::string name;  // "EXX", "C0Y", ...
        double position;   // mm; NaN if the output has no position
        std::string unit;  // "mm", "rad", "1"
    };
    virtual const std::vector<Output>& outputs() const = 0;

    // The bits of a sample depend on the model, the seed and the instruction set. Results record seed and instruction
    // set; only results that agree in both can be merged.
    virtual std::uint64_t seed() const = 0;
    virtual std::string target() const = 0;  // the instruction set: instruction_set()

    // Working memory of one thread. A worker must not outlive its model.
    class Worker {
    public:
        virtual ~Worker() = default;
        virtual void evaluate(const SampleBlock& block) = 0;
    };
    virtual std::unique_ptr<Worker> worker() const = 0;
};

}  // namespace stepdiag
