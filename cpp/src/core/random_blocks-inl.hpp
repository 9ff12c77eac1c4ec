// Random numbers of many samples at once in SIMD lanes: see stepdiag/core/random_blocks.hpp.
#if defined(STEPDIAG_RANDOM_BLOCKS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef STEPDIAG_RANDOM_BLOCKS_INL
#undef STEPDIAG_RANDOM_BLOCKS_INL
#else
#define STEPDIAG_RANDOM_BLOCKS_INL
#endif

#include <cstdint>

#include "core/simd-inl.hpp"
#include "stepdiag/core/random.hpp"

HWY_BEFORE_NAMESPACE();
namespace stepdiag {
namespace HWY_NAMESPACE {

using WordTag = hn::ScalableTag<std::uint64_t>;
using Words = hn::Vec<WordTag>;

struct WordPair {
    Words a, b;
};
struct TwoPairs {
    Pair first, second;
};

// a * b of the low 32 bits. The upper bits of the arguments are ignored.
STEPDIAG_INLINE Words low_product(Words a, Words b) {
#if HWY_TARGET == HWY_SCALAR  // has no vectors of two halves
    return hn::Set(WordTag(), std::uint64_t(std::uint32_t(hn::GetLane(a))) * std::uint32_t(hn::GetLane(b)));
#else
    const hn::Repartition<std::uint32_t, WordTag> halves;
    return hn::MulEven(hn::BitCast(halves, a), hn::BitCast(halves, b));
#endif
}

// (word >> 11) is below 2^53, so that the conversion is exact.
STEPDIAG_INLINE Vector to_unit(Words word) {
    const hn::RebindToSigned<WordTag> integers;
    const Vector number = hn::ConvertTo(Tag(), hn::BitCast(integers, hn::ShiftRight<11>(word)));
    return hn::MulAdd(number, hn::Set(Tag(), 0x1p-53), hn::Set(Tag(), 0x1p-54));
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
STEPDIAG_INLINE TwoPairs uniform_lanes(const RoundKeys& keys, RandomStream stream, WordPair sample, std::uint32_t item,
                                       std::uint16_t draw) {
    const WordTag tag;
    const Words m0 = hn::Set(tag, 0xD2511F53), m1 = hn::Set(tag, 0xCD9E8D57);
    // Only the lower halves are used; the upper halves contain remainders of earlier products.
    const Words last = hn::Set(tag, std::uint32_t(stream) | (std::uint32_t(draw) << 16));
    WordPair c0 = sample, c1 = {hn::ShiftRight<32>(sample.a), hn::ShiftRight<32>(sample.b)};
    WordPair c2 = {hn::Set(tag, item), hn::Set(tag, item)}, c3 = {last, last};
    for (const auto& key : keys.of_round) {
        const Words key0 = hn::Set(tag, key[0]), key1 = hn::Set(tag, key[1]);
        const WordPair product0 = {low_product(c0.a, m0), low_product(c0.b, m0)};
        const WordPair product1 = {low_product(c2.a, m1), low_product(c2.b, m1)};
        c0 = {hn::Xor3(hn::ShiftRight<32>(product1.a), c1.a, key0),
              hn::Xor3(hn::ShiftRight<32>(product1.b), c1.b, key0)};
        c2 = {hn::Xor3(hn::ShiftRight<32>(product0.a), c3.a, key1),
              hn::Xor3(hn::ShiftRight<32>(product0.b), c3.b, key1)};
        c1 = product1;
        c3 = product0;
    }
    const Words low = hn::Set(tag, 0xFFFFFFFF);
    const auto word = [&](Words high_half, Words low_half)
                          HWY_ATTR { return to_unit(hn::Or(hn::ShiftLeft<32>(high_half), hn::And(low_half, low))); };
    return {{word(c1.a, c0.a), word(c1.b, c0.b)}, {word(c3.a, c2.a), word(c3.b, c2.b)}};
}

// sum of c_k z^k from the highest one on
template <std::size_t Terms>
STEPDIAG_INLINE Pair polynomial(Pair z, const double (&c)[Terms]) {
    Pair sum = all(c[0]);
    for (std::size_t k = 1; k < Terms; ++k) sum = mul_add(sum, z, all(c[k]));
    return sum;
}

// u = 2^k (1 + f), sqrt(1/2) <= 1 + f < sqrt(2), for u in [2^-54, 1].
struct Split {
    Vector k, f;
};
STEPDIAG_INLINE Split split(Vector u) {
    const Tag tag;
    const WordTag words;
    const Words bits = hn::BitCast(words, u);
    const Words biased = hn::ShiftRight<52>(hn::Add(bits, hn::Set(words, 0x3FF0000000000000 - 0x3FE6A09E667F3BCD)));
    const Words m = hn::Sub(bits, hn::ShiftLeft<52>(hn::Sub(biased, hn::Set(words, 1023))));
    // With the exponent of 2^52, the low bits of a number are its integer value.
    return {
        hn::Sub(hn::BitCast(tag, hn::Or(biased, hn::Set(words, 0x4330000000000000))), hn::Set(tag, 0x1p52 + 1023.0)),
        hn::Sub(hn::BitCast(tag, m), hn::Set(tag, 1.0))};
}

// -2 ln u, relative error below 1e-15: ln(1 + f) by the series of fdlibm's e_log.c (Sun Microsystems, 1993) in
// s = f/(2 + f).
STEPDIAG_INLINE Pair minus_two_log(Pair u) {
    const Split a = split(u.a), b = split(u.b);
    const Pair k = {a.k, b.k}, f = {a.f, b.f}, s = f / (f + all(2.0)), z = s * s;
    const Pair series = polynomial(
        z, {1.479819860511658591e-01, 1.531383769920937332e-01, 1.818357216161805012e-01, 2.222219843214978396e-01,
            2.857142874366239149e-01, 3.999999999940941908e-01, 6.666666666666735130e-01});
    const Pair half_square = f * f * all(0.5);
    const Pair low = mul_add(s, mul_add(series, z, half_square), k * all(1.90821492927058770002e-10));
    return mul_add(k, all(6.93147180369123816490e-01), f - (half_square - low)) * all(-2.0);
}

// Rotates x by quarters of a turn, whose number is in the low bits of `rounded`. A quarter changes cos to -sin and sin
// to cos.
struct CosSin {
    Vector cosine, sine;
};
STEPDIAG_INLINE CosSin turn_by_quarters(Vector cosine, Vector sine, Vector rounded) {
    const Tag tag;
    const WordTag words;
    const Words quarter = hn::BitCast(words, rounded), one = hn::Set(words, 1);
    const auto is_odd = hn::MaskFromVec(hn::BitCast(tag, hn::Sub(hn::Zero(words), hn::And(quarter, one))));
    const auto second_bit_as_sign = [&](Words n)
                                        HWY_ATTR { return hn::BitCast(tag, hn::ShiftLeft<63>(hn::ShiftRight<1>(n))); };
    return {hn::Xor(hn::IfThenElse(is_odd, sine, cosine), second_bit_as_sign(hn::Add(quarter, one))),
            hn::Xor(hn::IfThenElse(is_odd, cosine, sine), second_bit_as_sign(quarter))};
}

// cos and sin of v turns, v in [0, 1], with an absolute error below 3e-16: series of fdlibm's k_cos.c and k_sin.c for
// the rest of a quarter turn.
STEPDIAG_INLINE TwoPairs cos_sin_of_turns(Pair v) {
    const Pair magic = all(0x1.8p52);  // adding it rounds to an integer, which is then in the low bits
    const Pair rounded = mul_add(v, all(4.0), magic);
    const Pair rest = sub_mul(rounded - magic, all(0.25), v);  // exact
    const Pair x = rest * all(6.283185307179586), z = x * x;
    const Pair odd =
        polynomial(z, {1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06,
                       -1.98412698298579493134e-04, 8.33333333332248946124e-03, -1.66666666666666324348e-01});
    const Pair cosine =
        polynomial(z, {-1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07,
                       2.48015872894767294178e-05, -1.38888888888741095749e-03, 4.16666666666666019037e-02, -0.5, 1.0});
    const Pair sine = mul_add(x * z, odd, x);
    const CosSin a = turn_by_quarters(cosine.a, sine.a, rounded.a), b = turn_by_quarters(cosine.b, sine.b, rounded.b);
    return {{a.cosine, b.cosine}, {a.sine, b.sine}};
}

// normal_pair of a uniform_pair, by Box and Muller.
STEPDIAG_INLINE TwoPairs normal_lanes(const TwoPairs& uniform) {
    const Pair radius = root(minus_two_log(uniform.first));
    const TwoPairs turned = cos_sin_of_turns(uniform.second);
    return {radius * turned.first, radius * turned.second};
}

}  // namespace HWY_NAMESPACE
}  // namespace stepdiag
HWY_AFTER_NAMESPACE();

#endif
