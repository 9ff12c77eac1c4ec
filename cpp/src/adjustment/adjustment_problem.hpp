// The adjustment's unknowns, readings and their order, made once from a run's pattern. Internal: not installed.
// The machine is unknown at nodes: the six errors of one axis at one position (squareness terms included), approached
// in one direction. Nodes inside the travel are blocks of six in a band; nodes at its ends, whose values fix slopes,
// and the set-ups of the lines are the border. Both ends of the travel are folded together (nodes k and N - k are
// neighbours), so that lines of every sign couple blocks that stand near each other.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "adjustment/bordered_band.hpp"
#include "adjustment/channel_model.hpp"
#include "stepdiag/adjustment/options.hpp"
#include "stepdiag/adjustment/results.hpp"

namespace stepdiag {

inline constexpr int no_unknown = -1;

// The errors of an axis at a node. `unknown`: index of each error among all unknowns, or no_unknown where the frame
// choice says 0.
struct AxisNode {
    Axis axis;
    int node;       // 0 .. steps, from home
    bool negative;  // approached in - direction, where both are distinguished
    double position;
    int block = no_unknown;  // in the band; none for the ends of travel
    std::array<int, 6> unknown{no_unknown, no_unknown, no_unknown, no_unknown, no_unknown, no_unknown};
};

// How head and mirror stood on one line.
struct LineSetup {
    int run;
    Line line;
    bool is_scale_line;
    ChannelModel model;
    std::vector<PriorUncertainty> prior;  // by setup::Column
    std::vector<int> unknown;             // likewise
    std::vector<int> active;              // columns that are unknown
    std::optional<double> first_time = {};
};

struct AdjustedReading {
    std::size_t row;
    int channel;  // of the head: a row of the model
    double value;
    double noise;                 // standard uncertainty: what is stated, or its rounding where that is more
    double standard_uncertainty;  // the same times a noise factor, or what the solution can bear where that is more
    double of_doubles = 0.0;      // standard uncertainty by the rounding of doubles, in it and in its model
    double rounding = 0.0;        // the same, or by the decimals of the file where that is more
    int outlier = 0;              // as in ReadingResidual

    bool used() const { return outlier == 0; }
};

// What moves axes along themselves in proportion to something that is known at each point: an expansion coefficient,
// its deviation from what is stated, or a rate of the machine's drift.
struct CoefficientUnknown {
    AxisGroup axes;
    PriorUncertainty prior;  // 1/K; mm/s or mm/K
    bool of_drift;
    int unknown = no_unknown;

    double effect(const ReadingPlace& place, int axis) const { return of_drift ? place.drifted : place.stretch[axis]; }
};

// What each of some readings reads too much by a fault of size 1.
struct ReadingPattern {
    std::vector<int> readings;
    std::vector<double> share;

    bool operator==(const ReadingPattern& other) const { return readings == other.readings && share == other.share; }
};

// A fault whose size is an unknown.
struct EstimatedFault {
    ReadingPattern pattern;
    PriorUncertainty prior;  // of the size
    double usual;            // size that it may have where nothing tells it
    int group;  // of alternatives, of which one is the fault: together they are one thing that was not known
    int unknown = no_unknown;
};

// One point of one pass, and its readings: readings[first_reading .. end_reading).
struct AdjustedPoint {
    int setup;
    std::array<int, 3> node;       // by axis: index of the AxisNode; no_unknown: at home
    std::array<bool, 3> negative;  // by axis: approached in - direction
    ReadingPlace place;
    int first_reading, end_reading;
};

// Which unknowns the factor eliminates last. The set-ups, in a dense border behind the nodes' band: its time grows with
// the third power of their number. Or the nodes, which are then dense, and the set-ups are leaves: its time grows with
// the third power of the number of nodes, and with that of the set-ups.
enum class Elimination { cheapest, set_ups_last };

class AdjustmentProblem {
public:
    AdjustmentProblem(const Measurement& measurement, const Plan& plan, const Chain& chain, const Eigen::Vector3d& tool,
                      const HeadCalibrations& heads, const AdjustmentOptions& options,
                      Elimination elimination = Elimination::cheapest);

    const Plan& plan() const { return plan_; }
    const Chain& chain() const { return chain_; }
    const Eigen::Vector3d& tool() const { return tool_; }
    const std::vector<AxisNode>& nodes() const { return nodes_; }
    const AxisNode* find(Axis axis, int node, bool negative) const;  // nullptr where no reading visits it
    // The nodes of each axis and direction that readings visit, ascending, by index.
    std::vector<std::vector<int>> node_chains() const;
    const std::vector<LineSetup>& setups() const { return setups_; }
    const std::vector<AdjustedPoint>& points() const { return points_; }
    std::vector<AdjustedReading>& readings() { return readings_; }
    const std::vector<AdjustedReading>& readings() const { return readings_; }
    bool tells_reversal() const { return reversal_; }
    bool has_rotations() const { return rotations_; }
    std::string channel_name(const AdjustedReading& reading) const;
    bool is_length(const AdjustedReading& reading) const;             // mm rather than rad
    std::string noise_channel(const AdjustedReading& reading) const;  // of NoiseFactor
    void weigh(const std::vector<NoiseFactor>& noise);                // instead of what it was weighed with before
    // Channels of which stated uncertainties were below the rounding of readings.
    const std::vector<RoundedChannel>& rounded() const { return rounded_; }

    const std::vector<int>& reach() const { return reach_; }  // of the band's block columns
    int blocks() const { return int(reach_.size()); }
    int border() const { return border_; }
    // Unknowns of the set-ups, by set-up, where they are leaves of the matrix; otherwise none.
    const Leaves& leaves() const { return leaves_; }
    int dense_border() const { return border_ - leaf_unknowns_; }
    const std::vector<CoefficientUnknown>& coefficients() const { return coefficients_; }
    const std::optional<KnownExpansion>& expansion() const { return expansion_; }
    bool moves_axes() const { return expansion_ || !coefficients_.empty(); }  // by more than their errors
    const std::vector<AxisGroup>& sensors() const { return sensors_; }        // of the scales' temperatures
    const std::vector<EstimatedFault>& faults() const { return faults_; }
    // Instead of those that there were; their unknowns are the last ones.
    void estimate(std::vector<EstimatedFault> faults);
    int size() const { return 6 * blocks() + border_; }
    int unknowns() const { return size() - (has_rotations() ? 0 : 3 * blocks()); }  // the band has places without one

    int block_of(int node) const { return node == no_unknown ? no_unknown : nodes_[node].block; }
    // The errors of the three axes at a point, for the unknowns' values `x`; the scales' expansion is in their
    // translations.
    MachineErrors errors(const AdjustedPoint& point, const Eigen::VectorXd& x) const;
    Eigen::VectorXd setup_values(const LineSetup& setup, const Eigen::VectorXd& x) const;
    // Of an unknown of the set-ups or a fault: its prior's standard uncertainty; infinite elsewhere.
    const std::vector<double>& prior() const { return prior_; }
    // Those that are no limits of what is called free; of alternatives, that all but one are no fault.
    int informative_priors() const;
    void free_set_up(SetupQuantity quantity);  // on all lines where it is an unknown
    // How far from 0 each unknown usually is.
    const std::vector<double>& usual() const { return usual_; }
    // What makes changes of unknowns comparable: 1 for angles (rad), 1/metre for lengths (mm).
    const std::vector<double>& change_scale() const { return change_scale_; }

private:
    void collect_setups(const Measurement& measurement, const AdjustmentOptions& options);
    void collect_points(const Measurement& measurement, const AdjustmentOptions& options);
    void round_uncertainties();
    void number_unknowns(const AdjustmentOptions& options, Elimination elimination);
    int number_nodes(const AdjustmentOptions& options);
    void find_reach(int blocks, const AdjustmentOptions& options);
    void choose_elimination(Elimination elimination, int first_of_set_ups);
    void sort_points();
    void weigh_unknowns();
    int node_index(Axis axis, int node, bool negative);

    Plan plan_;
    Chain chain_;
    Eigen::Vector3d tool_;
    std::shared_ptr<const HeadCalibrations> heads_;
    HeadLayout kind_;
    bool reversal_ = false, rotations_ = true;
    std::vector<AxisNode> nodes_;
    std::array<std::vector<int>, 6> node_at_;  // by axis and direction: index by node number
    std::vector<LineSetup> setups_;
    std::vector<int> setup_of_row_;
    std::vector<AdjustedPoint> points_;
    std::vector<AdjustedReading> readings_;
    std::vector<RoundedChannel> rounded_;
    std::vector<int> reach_;
    int border_ = 0;
    Leaves leaves_;
    int leaf_unknowns_ = 0;
    std::optional<KnownExpansion> expansion_;
    std::vector<CoefficientUnknown> coefficients_;
    std::vector<AxisGroup> sensors_;
    std::vector<EstimatedFault> faults_;
    std::vector<double> prior_, usual_, change_scale_;
};

}  // namespace stepdiag
