// Damages a valid text reproducibly: replaces, removes or repeats bytes, or cuts off the end.
#pragma once

#include <random>
#include <string>

class Spoiler {
public:
    explicit Spoiler(unsigned seed) : engine_(seed) {}

    std::string operator()(std::string text) {
        for (int change = 1 + pick(3); change > 0 && !text.empty(); --change) {
            const std::size_t start = pick(text.size()), length = pick(30);
            switch (pick(4)) {
                case 0:
                    for (std::size_t i = start; i < text.size() && i < start + length; ++i) text[i] = char(pick(256));
                    break;
                case 1: text.erase(start, length); break;
                case 2: text.insert(start, text.substr(start, length)); break;
                default: text.resize(start);
            }
        }
        return text;
    }

private:
    std::size_t pick(std::size_t count) { return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_); }
    std::mt19937 engine_;
};
