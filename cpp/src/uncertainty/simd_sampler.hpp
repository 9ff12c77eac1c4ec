// The readings of `lane_group` samples at once, one a lane of SIMD vectors, every pose by replay (simd_pass).
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "uncertainty/beam_paths.hpp"
#include "uncertainty/simd_pass.hpp"

namespace stepdiag {

class SimdSampler {
public:
    // None where a head needs the scalar sampler (record_paths), or all poses are to be traced.
    static std::unique_ptr<const SimdSampler> make(const RunModel& model);

    // What a thread writes to.
    class Scratch {
    public:
        explicit Scratch(const SimdSampler& run);

    private:
        friend class SimdSampler;
        // A head's numbers by lane, and the beams that point at them.
        struct HeadRows {
            std::vector<SimdRow> rows;
            std::vector<SimdBeam> beams;
            SimdRow* index_ratio = nullptr;  // closed layouts
            SimdRow* psd_distance = nullptr;
            SimdRow* beam_offsets = nullptr;
        };
        std::vector<HeadRows> heads;
        std::vector<std::vector<SimdRow>> fields;  // by line
        std::vector<SimdSetup> setups;
        std::vector<std::vector<SimdRow>> closed_beams;  // by line, gain included
        std::vector<SimdRow> shared;
        std::vector<SimdRow> displaced, turned;
        std::vector<SimdRow> excess;
        std::vector<SimdRow> numbers;  // drawn
    };

    // Readings without noise: [(row * channels + channel) * lane_group + lane]. `deviations`: [input * lane_group +
    // lane]. `first_sample`: of the displacements of the tool that are drawn; none: none are. `followed` becomes 0 for
    // lanes that need the scalar sampler.
    void trace(const double* deviations, std::optional<std::uint64_t> first_sample, Scratch& scratch, double* readings,
               std::uint8_t* followed) const;
    // Adds the reading noise.
    void add_noise(std::uint64_t first_sample, Scratch& scratch, double* readings) const;

private:
    struct Line {
        LineFrame frame;
        std::size_t head;
        bool setup_varies, corrects;
    };

    explicit SimdSampler(const RunModel& model) : model_(model) {}
    void prepare_head(const HeadPaths& paths, Scratch::HeadRows& to) const;
    void fill_head(const HeadPaths& paths, const double* deviations, const Scratch& scratch,
                   Scratch::HeadRows& to) const;
    void fill_air(const HeadPaths& paths, const Scratch& scratch, Scratch::HeadRows& to) const;
    void move_parts(const HeadPaths& paths, const double* deviations, Scratch::HeadRows& to) const;
    void fill_fields(const Fields& fields, const double* deviations, std::vector<SimdRow>& to) const;
    void displace(std::optional<std::uint64_t> first_sample, Scratch& scratch) const;
    // Draws a noise once for all rows and adds its numbers to rows `stride` apart, from each of `to` on.
    void add_draws(std::size_t entry, std::uint64_t first_sample, Scratch& scratch, const std::vector<double*>& to,
                   std::size_t stride) const;
    void correct(const RunPass& pass, const SimdPass& lanes, const Scratch& scratch) const;

    const RunModel& model_;
    std::vector<HeadPaths> heads_;
    std::vector<Line> lines_;
    std::vector<ToolPose> poses_;
    std::vector<double> elapsed_, travel_, length_share_;
    std::vector<std::uint8_t> is_distance_;
    bool heads_vary_, reads_excess_;
};

}  // namespace stepdiag
