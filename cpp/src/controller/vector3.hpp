// Vector operations of the compensator, on one position or on four. Components are plain numbers, which compilers keep
// in registers.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

// Inlines whole evaluations, so that the compiler can use the known values of their arguments.
#define STEPDIAG_INLINED [[gnu::always_inline]] inline
// How calls pass Four depends on the instruction set: no call does, because all of this is inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace stepdiag {

// Four numbers that are computed at once where the processor can: of four positions, or of one.
using Four = double __attribute__((vector_size(32)));

// `value` as a number N: a double, or in each of Four.
template <class N>
STEPDIAG_INLINED N broadcast(double value) noexcept {
    if constexpr (std::is_same_v<N, double>) return value;
    else return N{value, value, value, value};
}

template <class N>
struct Vector3Of {
    N x, y, z;
};
using Vector3 = Vector3Of<double>;

// x, y or z, for an axis known at compile time.
template <int axis, class Triple>
STEPDIAG_INLINED auto& of_axis(Triple& v) noexcept {
    static_assert(axis >= 0 && axis < 3);
    if constexpr (axis == 0) return v.x;
    else if constexpr (axis == 1) return v.y;
    else return v.z;
}

template <class N>
STEPDIAG_INLINED Vector3Of<N> broadcast(const Vector3& v) noexcept {
    return {broadcast<N>(v.x), broadcast<N>(v.y), broadcast<N>(v.z)};
}
template <class N>
STEPDIAG_INLINED Vector3Of<N> operator+(const Vector3Of<N>& a, const Vector3Of<N>& b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class N>
STEPDIAG_INLINED Vector3Of<N> operator-(const Vector3Of<N>& a, const Vector3Of<N>& b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class S, class N>
STEPDIAG_INLINED Vector3Of<N> operator*(const S& s, const Vector3Of<N>& v) noexcept {
    return {s * v.x, s * v.y, s * v.z};
}
template <class N>
STEPDIAG_INLINED N dot(const Vector3Of<N>& a, const Vector3Of<N>& b) noexcept {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class N>
STEPDIAG_INLINED Vector3Of<N> cross(const Vector3Of<N>& a, const Vector3Of<N>& b) noexcept {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// v + a x b, in an order that gives two fused multiply-adds for each component.
template <class N>
STEPDIAG_INLINED Vector3Of<N> add_cross(const Vector3Of<N>& v, const Vector3Of<N>& a, const Vector3Of<N>& b) noexcept {
    return {(v.x - a.z * b.y) + a.y * b.z, (v.y - a.x * b.z) + a.z * b.x, (v.z - a.y * b.x) + a.x * b.y};
}
// v x e_axis
template <int axis, class N>
STEPDIAG_INLINED Vector3Of<N> cross_unit(const Vector3Of<N>& v) noexcept {
    if constexpr (axis == 0) return {N{}, v.z, -v.y};
    else if constexpr (axis == 1) return {-v.z, N{}, v.x};
    else return {v.y, -v.x, N{}};
}
// Whether all `count` numbers are below 2^500 in magnitude: finite, and so are their squares. By their bits, because
// arithmetic with a NaN or an infinity, and comparison with a NaN, raise FE_INVALID: a program that traps it would end.
template <std::size_t count>
STEPDIAG_INLINED bool are_moderate(const double* v) noexcept {
    constexpr std::uint64_t sign = std::uint64_t(1) << 63, limit = std::uint64_t(1023 + 500) << 52;
    std::uint64_t carry = 0;
    for (std::size_t i = 0; i < count; ++i) {
        std::uint64_t bits;
        std::memcpy(&bits, v + i, sizeof bits);
        carry |= (bits & ~sign) + (sign - limit);
    }
    return (carry & sign) == 0;
}
// Likewise by its bits.
inline bool is_nan(double number) noexcept {
    std::uint64_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    return bits << 1 > std::uint64_t(0x7ff) << 53;
}
STEPDIAG_INLINED Vector3 read(const double* v) noexcept { return {v[0], v[1], v[2]}; }
STEPDIAG_INLINED void write(const Vector3& v, double* out) noexcept { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

// Four vectors at once: of rows (4, 3), and with their components in four rows.
STEPDIAG_INLINED Vector3Of<Four> read_four(const double* v) noexcept {
    return {Four{v[0], v[3], v[6], v[9]}, Four{v[1], v[4], v[7], v[10]}, Four{v[2], v[5], v[8], v[11]}};
}
STEPDIAG_INLINED Vector3 lane(const Vector3Of<Four>& v, std::size_t i) noexcept { return {v.x[i], v.y[i], v.z[i]}; }
STEPDIAG_INLINED void write_four(const Vector3Of<Four>& v, double* out) noexcept {
    for (std::size_t i = 0; i < 4; ++i) write(lane(v, i), out + 3 * i);
}
struct FourRows {
    Four a, b, c, d;
};
STEPDIAG_INLINED FourRows transposed(const FourRows& m) noexcept {
    const Four even01 = __builtin_shufflevector(m.a, m.b, 0, 4, 2, 6),
               odd01 = __builtin_shufflevector(m.a, m.b, 1, 5, 3, 7),
               even23 = __builtin_shufflevector(m.c, m.d, 0, 4, 2, 6),
               odd23 = __builtin_shufflevector(m.c, m.d, 1, 5, 3, 7);
    return {__builtin_shufflevector(even01, even23, 0, 1, 4, 5), __builtin_shufflevector(odd01, odd23, 0, 1, 4, 5),
            __builtin_shufflevector(even01, even23, 2, 3, 6, 7), __builtin_shufflevector(odd01, odd23, 2, 3, 6, 7)};
}

// What a comparison of Four gives: -1 where it is true.
using FourTruths = decltype(Four{} <= Four{});
STEPDIAG_INLINED bool all(const FourTruths& truths) noexcept {
    return (truths[0] & truths[1] & truths[2] & truths[3]) != 0;
}

// Box of positions from `lowest` to `highest` in each component.
struct Box {
    Vector3 lowest, highest;

    STEPDIAG_INLINED bool holds(const Vector3& v) const noexcept {
        return lowest.x <= v.x && v.x <= highest.x && lowest.y <= v.y && v.y <= highest.y && lowest.z <= v.z &&
               v.z <= highest.z;
    }
    STEPDIAG_INLINED bool holds(const Vector3Of<Four>& v) const noexcept {  // all
        return all((lowest.x <= v.x) & (v.x <= highest.x) & (lowest.y <= v.y) & (v.y <= highest.y) & (lowest.z <= v.z) &
                   (v.z <= highest.z));
    }
    STEPDIAG_INLINED Vector3 nearest(const Vector3& v) const noexcept {
        return {std::min(std::max(v.x, lowest.x), highest.x), std::min(std::max(v.y, lowest.y), highest.y),
                std::min(std::max(v.z, lowest.z), highest.z)};
    }
    Box grown(double by) const noexcept {
        const Vector3 all = {by, by, by};
        return {lowest - all, highest + all};
    }
};

// A 3 x 3 matrix by its columns.
template <class N>
struct Matrix3Of {
    Vector3Of<N> x, y, z;
};
template <class N>
STEPDIAG_INLINED Vector3Of<N> operator*(const Matrix3Of<N>& m, const Vector3Of<N>& v) noexcept {
    return v.x * m.x + v.y * m.y + v.z * m.z;
}

}  // namespace stepdiag
