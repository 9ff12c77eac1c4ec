"""Damage to bytes, by a seed."""

import random


def mutated(content: bytes, seed: int) -> bytes:
    """Flipped bits, other bytes, cut, a line or a block twice, gone or elsewhere; sometimes several of these."""
    chance = random.Random(seed)
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        if not data:
            break
        what, place = chance.randrange(8), chance.randrange(len(data))
        if what == 0:
            data[place] ^= 1 << chance.randrange(8)
        elif what == 1:
            data[place] = chance.choice(b'0123456789.,;-+eEnN"#=\n\r\t \0\xff')
        elif what == 2:
            del data[place:]
        elif what == 3:
            del data[place : place + chance.choice((1, 2, 7, 64))]
        elif what == 4:
            data[place:place] = data[chance.randrange(len(data)) :][: chance.choice((1, 3, 80))]
        else:
            lines = bytes(data).splitlines(keepends=True)
            one, other = chance.randrange(len(lines)), chance.randrange(len(lines))
            if what == 5:
                del lines[one]
            elif what == 6:
                lines.insert(other, lines[one])
            else:
                lines[one], lines[other] = lines[other], lines[one]
            data = bytearray(b"".join(lines))
    return bytes(data)
