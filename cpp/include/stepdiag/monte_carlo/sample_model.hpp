// A measurement model as the Monte Carlo method sees it (JCGM 101, 5.9): outputs of sample after sample, each a pure
// function of the seed and the sample's index.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stepdiag {

// Outputs of a block of samples: a row each output, a column each sample, columns contiguous.
struct SampleBlock {
    std::uint64_t first_sample;  // a multiple of lane_group
    std::size_t samples;         // a multiple of lane_group
    double* outputs;  // outputs[output * samples + sample]; NaN in all outputs of a sample that gave no result

    double* output(std::size_t index) const { return outputs + index * samples; }
};

class SampleModel {
public:
    virtual ~SampleModel() = default;

    struct Output {
        std::string name;  // "EXX", "C0Y", ...
        double position;   // mm; NaN where it has none
        std::string unit;  // "mm", "rad", "1"
    };
    virtual const std::vector<Output>& outputs() const = 0;

    // What the bits of a sample depend on, beside the model itself: results record them, and only what agrees in them
    // is merged.
    virtual std::uint64_t seed() const = 0;
    virtual std::string target() const = 0;  // the instruction set: instruction_set()

    // One a thread: holds what a thread writes to. Outlives no model.
    class Worker {
    public:
        virtual ~Worker() = default;
        virtual void evaluate(const SampleBlock& block) = 0;
    };
    virtual std::unique_ptr<Worker> worker() const = 0;
};

}  // namespace stepdiag
