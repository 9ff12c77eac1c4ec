// Whole virtual calibrations: draw the inputs, set up head and mirror, trace every pose by replay, add noise, reduce,
// evaluate. Samples in lanes; the sample with index i is a pure function of (seed, i).
// Sample i is simulate() of a run in which the drawn deviations are added to what is nominal, and then the evaluation
// with the unperturbed calibration:
//   set-ups      Misalignment of each line
//   head         PoseError of each component (shift and rotation vector); psd_distance, beam_offsets of closed layouts
//   air          the true environment, n times 1 + refractive_index; readings are reduced with the nominal or assumed
//   tool poses   p + machine_drift t + walk + position noise, R = Exp(orientation noise) R of the machine's errors,
//                t from the run's first reading
// A distance d of simulate(), its set-up included, is read as
//   (d + reading_model L tan^2 phi) / (1 + wavelength) + scale_factor s + share scale_length + noise
// with L and phi of the head's axis, s the commanded travel from the line's first point, the share 1 at its
// last point (on a scale line it grows with s, elsewhere it is 0 before), the walk of the head counting
// from a set-up's first reading. What does not matter is left out: dispersion over the wavelength's error. A sample in
// which a reading is lost, or whose air is out of the equation's range, has no result.
// Counters of random numbers: RandomBlock{sample, item, draw} of the stream `virtual_calibration`; items: see
// cpp/src/uncertainty/draws.hpp, their one home.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "stepdiag/batch/batch_evaluator.hpp"
#include "stepdiag/monte_carlo/sample_model.hpp"
#include "stepdiag/simulation/simulate.hpp"
#include "stepdiag/uncertainty/inputs.hpp"

namespace stepdiag {

// What a run is made of, and what is uncertain about it. Noise in `simulation` is not used: `inputs` has it.
struct VirtualRun {
    Machine machine;
    Plan plan;
    Heads heads;                   // as they are
    HeadCalibrations calibration;  // as the evaluation takes them
    SimulationOptions simulation;  // nominal set-ups, air, repeats
    UncertainInputs inputs;
    double seconds_per_reading = 1.0;  // where drifts or walks need times and the simulation says none
};

// Quantities derived from a calibration's values, appended to them as outputs: rows of a matrix on the entries.
struct DerivedOutput {
    std::string name;     // "e_x at (400, 300, 250)"
    std::string unit;     // "mm", "rad"
    Eigen::VectorXd row;  // coefficients by entry
};

// Samples so far.
struct SampleCount {
    std::uint64_t replayed;  // in lanes
    std::uint64_t traced;    // whole, because a replay did not fit, or no head of this kind can be replayed
    std::uint64_t verified;  // of those replayed: one reading of each pass traced again
};

// Deviations of one sample's inputs (order of UncertainInputs::inputs).
Eigen::VectorXd drawn_inputs(const UncertainInputs& inputs, std::uint64_t seed, std::uint64_t sample);

class VirtualCalibrations : public SampleModel {
public:
    // Throws InvalidArgument for inputs of lines, parts or channels that are not there, what simulate and the
    // evaluation refuse.
    VirtualCalibrations(const VirtualRun& run, const BatchOptions& evaluation, std::uint64_t seed,
                        std::vector<DerivedOutput> derived = {});
    ~VirtualCalibrations() override;

    const std::vector<Output>& outputs() const override;
    std::uint64_t seed() const override;
    std::string target() const override;
    std::unique_ptr<Worker> worker() const override;

    const VirtualRun& run() const;
    const std::vector<DerivedOutput>& derived() const;
    const BatchEvaluator& evaluator() const;
    const Measurement& nominal() const;  // the run with every input at its expectation, without noise

    bool is_in_lanes() const;  // whether samples are replayed at all
    SampleCount count() const;

    // The outputs for given deviations of the inputs (a column a case), without reading noise: for propagation.
    Eigen::MatrixXd evaluate_at(const Eigen::MatrixXd& deviations) const;
    // Raw readings of one sample, noise included: [row * channels + channel]; for tests.
    Eigen::VectorXd readings(std::uint64_t sample) const;

private:
    class Lanes;
    struct State;
    std::unique_ptr<const State> state_;
};

}  // namespace stepdiag
