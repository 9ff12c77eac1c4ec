// Items of work taken one after the other by several threads. Internal.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "stepdiag/monte_carlo/monte_carlo.hpp"

namespace stepdiag {

int thread_count(const RunControl& control, std::uint64_t items);

// What threads and the one that waits for them tell each other.
struct Progress {
    std::atomic<bool> stop{false};     // take no further item
    std::atomic<bool> abandon{false};  // leave the one in hand
    std::atomic<std::uint64_t> done{0};
};
// Does one item; counts the leaves that are done.
using Work = std::function<void(std::uint64_t item, Progress& progress)>;

// `make_work(thread)` is called once by each thread. Exceptions of any of them, and of go_on, come through.
void work_through(std::uint64_t items, const RunControl& control, const std::function<Work(int thread)>& make_work);

}  // namespace stepdiag
