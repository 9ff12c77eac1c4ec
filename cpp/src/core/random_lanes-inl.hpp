// Random numbers of many samples at once, for loops over vectors of lanes: see stepdiag/core/random_lanes.hpp.
#if defined(STEPDIAG_RANDOM_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_RANDOM_LANES_INL
#undef STEPDIAG_RANDOM_LANES_INL
#else
#define STEPDIAG_RANDOM_LANES_INL
#endif

#include <hwy/highway.h>

#include <cstdint>

#include "stepdiag/core/random.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Tag = hn::ScalableTag<double>;
using Vector = hn::Vec<Tag>;
using WordTag = hn::ScalableTag<std::uint64_t>;
using Words = hn::Vec<WordTag>;

struct TwoVectors {
    Vector first, second;
};

// a * b of the low 32 bits; what stands above them is not looked at.
HWY_INLINE Words low_product(Words a, Words b) {
#if HWY_TARGET == HWY_SCALAR  // has no vectors of two halves
    return hn::Set(WordTag(), std::uint64_t(std::uint32_t(hn::GetLane(a))) * std::uint32_t(hn::GetLane(b)));
#else
    const hn::Repartition<std::uint32_t, WordTag> halves;
    return hn::MulEven(hn::BitCast(halves, a), hn::BitCast(halves, b));
#endif
}

// (word >> 11) is below 2^53, so that the conversion is exact.
HWY_INLINE Vector to_unit(Words word) {
    const hn::RebindToSigned<WordTag> integers;
    const Vector number = hn::ConvertTo(Tag(), hn::BitCast(integers, hn::ShiftRight<11>(word)));
    return hn::Mul(hn::Add(number, hn::Set(Tag(), 0.5)), hn::Set(Tag(), 0x1p-53));
}

// The keys of the ten rounds of Philox4x32, from the seed.
struct RoundKeys {
    std::uint64_t of_round[10][2];

    explicit RoundKeys(std::uint64_t seed) {
        std::uint32_t key0 = std::uint32_t(seed), key1 = std::uint32_t(seed >> 32);
        for (auto& key : of_round) {
            key[0] = key0, key[1] = key1;
            key0 += 0x9E3779B9, key1 += 0xBB67AE85;
        }
    }
};

// uniform_pair for RandomBlock{sample, item, draw}, `sample` a lane: Philox4x32-10, a 32-bit word of its counter in
// each 64-bit lane.
HWY_INLINE TwoVectors uniform_lanes(const RoundKeys& keys, RandomStream stream, Words sample, std::uint32_t item,
                                    std::uint16_t draw) {
    const WordTag tag;
    const Words m0 = hn::Set(tag, 0xD2511F53), m1 = hn::Set(tag, 0xCD9E8D57);
    // Only the low halves count; above them stands what is left of earlier products.
    Words c0 = sample, c1 = hn::ShiftRight<32>(sample), c2 = hn::Set(tag, item),
          c3 = hn::Set(tag, std::uint32_t(stream) | (std::uint32_t(draw) << 16));
    for (const auto& key : keys.of_round) {
        const Words product0 = low_product(c0, m0), product1 = low_product(c2, m1);
        c0 = hn::Xor3(hn::ShiftRight<32>(product1), c1, hn::Set(tag, key[0]));
        c2 = hn::Xor3(hn::ShiftRight<32>(product0), c3, hn::Set(tag, key[1]));
        c1 = product1;
        c3 = product0;
    }
    const Words low = hn::Set(tag, 0xFFFFFFFF);
    return {to_unit(hn::Or(hn::ShiftLeft<32>(c1), hn::And(c0, low))),
            to_unit(hn::Or(hn::ShiftLeft<32>(c3), hn::And(c2, low)))};
}

// -2 ln u for u in [2^-54, 1], relative error below 1e-15: u = 2^k m, sqrt(1/2) <= m < sqrt(2), and ln m by the series
// of fdlibm's e_log.c (Sun Microsystems, 1993) in s = f/(2 + f), f = m - 1.
HWY_INLINE Vector minus_two_log(Vector u) {
    const Tag tag;
    const WordTag words;
    const Words bits = hn::BitCast(words, u);
    const Words biased = hn::ShiftRight<52>(hn::Add(bits, hn::Set(words, 0x3FF0000000000000 - 0x3FE6A09E667F3BCD)));
    const Vector k =
        hn::Sub(hn::BitCast(tag, hn::Or(biased, hn::Set(words, 0x4330000000000000))), hn::Set(tag, 0x1p52 + 1023.0));
    const Vector m = hn::BitCast(tag, hn::Sub(bits, hn::ShiftLeft<52>(hn::Sub(biased, hn::Set(words, 1023)))));

    const Vector f = hn::Sub(m, hn::Set(tag, 1.0));
    const Vector s = hn::Div(f, hn::Add(f, hn::Set(tag, 2.0)));
    const Vector z = hn::Mul(s, s);
    Vector series = hn::Set(tag, 1.479819860511658591e-01);
    for (const double c : {1.531383769920937332e-01, 1.818357216161805012e-01, 2.222219843214978396e-01,
                           2.857142874366239149e-01, 3.999999999940941908e-01, 6.666666666666735130e-01})
        series = hn::MulAdd(series, z, hn::Set(tag, c));
    const Vector half_square = hn::Mul(hn::Mul(f, f), hn::Set(tag, 0.5));
    const Vector low =
        hn::MulAdd(s, hn::MulAdd(series, z, half_square), hn::Mul(k, hn::Set(tag, 1.90821492927058770002e-10)));
    const Vector log = hn::MulAdd(k, hn::Set(tag, 6.93147180369123816490e-01), hn::Sub(f, hn::Sub(half_square, low)));
    return hn::Mul(log, hn::Set(tag, -2.0));
}

// cos and sin of v turns, v in [0, 1], absolute error below 3e-16: of the rest of a quarter turn by the series of
// fdlibm's k_cos.c and k_sin.c.
HWY_INLINE TwoVectors cos_sin_of_turns(Vector v) {
    const Tag tag;
    const WordTag words;
    const Vector magic = hn::Set(tag, 0x1.8p52);  // added, it rounds to integers, and the low bits are that integer
    const Vector rounded = hn::Add(hn::Mul(v, hn::Set(tag, 4.0)), magic);
    const Vector quarters = hn::Sub(rounded, magic);
    const Vector rest = hn::Sub(v, hn::Mul(quarters, hn::Set(tag, 0.25)));  // exact
    const Vector x = hn::Mul(rest, hn::Set(tag, 6.283185307179586));
    const Vector z = hn::Mul(x, x);
    Vector odd = hn::Set(tag, 1.58969099521155010221e-10), even = hn::Set(tag, -1.13596475577881948265e-11);
    for (const double c : {-2.50507602534068634195e-08, 2.75573137070700676789e-06, -1.98412698298579493134e-04,
                           8.33333333332248946124e-03, -1.66666666666666324348e-01})
        odd = hn::MulAdd(odd, z, hn::Set(tag, c));
    for (const double c : {2.08757232129817482790e-09, -2.75573143513906633035e-07, 2.48015872894767294178e-05,
                           -1.38888888888741095749e-03, 4.16666666666666019037e-02, -0.5})
        even = hn::MulAdd(even, z, hn::Set(tag, c));
    const Vector sine = hn::MulAdd(hn::Mul(x, z), odd, x), cosine = hn::MulAdd(even, z, hn::Set(tag, 1.0));

    // A quarter turn takes cos to -sin and sin to cos.
    const Words quarter = hn::BitCast(words, rounded), one = hn::Set(words, 1);
    const auto is_odd =
        hn::MaskFromVec(hn::BitCast(tag, hn::Sub(hn::Zero(words), hn::And(quarter, one))));  // all bits, or none
    const auto second_bit_as_sign = [&](Words n)
                                        HWY_ATTR { return hn::BitCast(tag, hn::ShiftLeft<63>(hn::ShiftRight<1>(n))); };
    return {hn::Xor(hn::IfThenElse(is_odd, sine, cosine), second_bit_as_sign(hn::Add(quarter, one))),
            hn::Xor(hn::IfThenElse(is_odd, cosine, sine), second_bit_as_sign(quarter))};
}

// normal_pair, by Box and Muller.
HWY_INLINE TwoVectors normal_lanes(const RoundKeys& keys, RandomStream stream, Words sample, std::uint32_t item,
                                   std::uint16_t draw) {
    const TwoVectors uniform = uniform_lanes(keys, stream, sample, item, draw);
    const Vector radius = hn::Sqrt(minus_two_log(uniform.first));
    const TwoVectors turned = cos_sin_of_turns(uniform.second);
    return {hn::Mul(radius, turned.first), hn::Mul(radius, turned.second)};
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
