// Volumetric compensation for a controller: a calibration file, loaded once, tells the error of the machine wherever it
// is sent, and where to send it instead.
//   forward(c) = c + e(c)                  where the tool is when the axes stand at c
//   command(t) = c with c + e(c) = t       where the axes must stand for the tool to be at t; c <- t - e(c), bounded
// e(c): error of the functional point, the exact pose of CONVENTIONS (machine.hpp) minus its nominal position, with the
// tool offset of the call, interpolated linearly between the nodes of the table. Positions are axis positions in the
// controller's machine coordinates, mm; `origin` is where these have home, the corner of the calibrated volume.
//
// Loading allocates and throws. After that every function is noexcept, allocates nothing, locks nothing, makes no
// system call, takes a bounded time, and may be called from many threads at once. compensator.h is the same in C.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace stepdiag {

struct CompensatorTables;
struct ParameterTable;

// What holds outside the calibrated volume. An error is judged by its position, a command by its target, a forward by
// its result, so that the three agree although command and target differ; 1e-6 mm beyond the edge still is inside.
enum class Outside {
    hold,    // the error of the nearest point of the volume
    linear,  // functions and squareness terms go on as in the last interval, up to `margin`; further out as `refuse`
    refuse   // no answer: CompensationStatus::refused
};

// Of a table with two directions of approach (reversal), which the compensator corrects: it knows no motion.
enum class CompensatedApproach { mean, positive, negative };

struct CompensatorOptions {
    std::array<double, 3> origin = {0.0, 0.0, 0.0};  // controller's coordinates of home, mm
    Outside outside = Outside::hold;
    double margin = 0.0;              // mm, with Outside::linear; at most the volume's shortest edge
    double largest_correction = 1.0;  // mm: command and forward shorten a longer error vector to this length
    CompensatedApproach approach = CompensatedApproach::mean;
    double largest_tool = 1000.0;  // mm: longer tools are refused; the bound of the inverse holds for all others
    bool accept_rejected = false;  // takes a table whose fit was rejected
};

// Flags: 0 is an answer inside the volume.
enum CompensationStatus : unsigned {
    compensation_outside = 1,  // outside the volume: held, linear or refused
    compensation_capped = 2,   // the error is longer than largest_correction, the correction is not
    compensation_refused = 4   // no answer: outside with Outside::refuse, beyond the margin, a position that is not
                              // finite or farther than 100 m, a tool longer than largest_tool; the position returned is
                              // the one asked for, an error is 0, and the machine must not move
};

struct MachineError {
    std::array<double, 3> position;     // e, mm: the whole of it, also where the correction is capped
    std::array<double, 3> orientation;  // rotation vector of the tool, rad
    unsigned status;
};

struct CompensatedPosition {
    std::array<double, 3> position;  // mm, controller's coordinates
    unsigned status;
};

class Compensator {
public:
    // Reads a calibration or error map. Throws InvalidArgument naming the file, line and key: what the table's reader
    // refuses; a table whose fit was rejected, unless accept_rejected; one without chain, volume_mm or tool_mm, or with
    // another chain than `chain`, the controller's; one without parameters, or with nodes that cannot be those of its
    // volume; errors so steep that the inverse has no bound; options that make no sense.
    static Compensator load(const std::string& path, const std::string& chain, const CompensatorOptions& options = {});
    // The same of a table in memory; `name` is what messages call it.
    Compensator(const ParameterTable& table, const std::string& name, const std::string& chain,
                const CompensatorOptions& options = {});
    ~Compensator();
    Compensator(Compensator&&) noexcept;
    Compensator& operator=(Compensator&&) noexcept;

    // `tool`: offset of the functional point from the tool's origin, mm.
    MachineError error(const std::array<double, 3>& position, const std::array<double, 3>& tool) const noexcept;
    CompensatedPosition command(const std::array<double, 3>& target, const std::array<double, 3>& tool) const noexcept;
    CompensatedPosition forward(const std::array<double, 3>& command, const std::array<double, 3>& tool) const noexcept;

    // The same on three numbers each, as in C; the answer, of which the status is returned, may replace the question.
    // `tool` may be null: that of the calibration. `orientation` may be null: it takes a third of the time.
    unsigned error(const double* position, const double* tool, double* error, double* orientation) const noexcept;
    unsigned command(const double* target, const double* tool, double* command) const noexcept;
    unsigned forward(const double* command, const double* tool, double* actual) const noexcept;

    // The table in force: a hash of chain, volume, tool, nodes and values, whatever the file's spelling and order.
    // Options, uncertainties, method and date are not in it.
    std::uint64_t fingerprint() const noexcept;
    // |forward(command(t)) - t| never exceeds this, mm, whatever the target, the tool and the options.
    double inverse_bound() const noexcept;
    std::array<double, 3> volume() const noexcept;  // mm
    std::array<double, 3> tool() const noexcept;    // of the calibration, mm
    // Verdict of the table's fit: "accepted", "doubtful", "rejected" or "unchecked"; empty where the table has none.
    // Whoever loads a doubtful or unchecked table should be told.
    const std::string& fit() const noexcept;
    // What the table does not tell and is therefore not compensated: "EXX", "EYX (slope)", "EXX (above 784.0 mm)",
    // "C0Y".
    const std::vector<std::string>& uncompensated() const noexcept;

private:
    std::unique_ptr<const CompensatorTables> tables_;
};

}  // namespace stepdiag
