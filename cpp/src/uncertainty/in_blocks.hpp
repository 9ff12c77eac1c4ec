// Work that is divided among threads. Internal.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace stepdiag {

// work(begin, end) for all blocks of 0 .. count, on as many threads as the computer runs at once. What a block writes
// must depend on the block alone.
template <class Work>
void in_blocks(Eigen::Index count, Eigen::Index together, Work&& work) {
    std::atomic<Eigen::Index> next{0};
    const auto run = [&] {
        for (Eigen::Index begin; (begin = together * next++) < count;) work(begin, std::min(begin + together, count));
    };
    const Eigen::Index blocks = (count + together - 1) / together;
    const auto threads = std::min(Eigen::Index(std::max(std::thread::hardware_concurrency(), 1u)), blocks);
    std::vector<std::thread> others(std::size_t(std::max(threads, Eigen::Index(1)) - 1));
    for (std::thread& other : others) other = std::thread(run);
    run();
    for (std::thread& other : others) other.join();
}

}  // namespace stepdiag
