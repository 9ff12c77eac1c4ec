"""What each published variant of the method can determine, from the same machine's volume and plan of 20 steps.

python examples/variants.py
"""

import stepdiag as sd

SCENARIO = """
[volume]
x_mm = 800.0
y_mm = 600.0
z_mm = 500.0
[machine]
chain = "[w X' b Y Z t]"
[plan]
steps = 20
lines = [{lines}]
order = [{orders}]
scale_lines = [{scale_lines}]
[head]
layout = "ideal"
tilts = {tilts}
[adjustment]
angles = "{angles}"
laser_urad = {laser}
one_setup_per_line = true
"""

BODY = ("ppp", "npp", "pnp", "nnp")
FACE = ("pp0", "np0", "p0p", "n0p", "0pp", "0np")
SCALE = ("p00", "0p0", "00p")
THREE = ("XYZ", "YZX", "ZXY")

LASER = 500.0  # µrad; how well it stands along a line where no tilts, or no points beside the line, tell

# Name: lines, scale lines, orders of the steps, whether tilts are read, whether the machine has angles.
VARIANTS = {
    "Wang 2000: distances, machine without angles": (BODY, SCALE, ("XYZ",), False, False),
    "Ibaraki, Hata: the same, no scale lines": (BODY, (), ("XYZ",), False, False),
    "distances, machine with angles": (BODY, SCALE, ("XYZ",), False, True),
    "Soons: the same in three orders": (BODY, SCALE, THREE, False, True),
    "the same with six face diagonals": (BODY + FACE, SCALE, THREE, False, True),
    "Bui: face diagonals with tilts, no scale lines": (FACE, (), ("XYZ",), True, True),
    "Dahlem 2018: distances and tilts": (BODY, SCALE, ("XYZ",), True, True),
    "the same, no scale lines": (BODY, (), ("XYZ",), True, True),
}


def row(
    lines: tuple[str, ...], scale_lines: tuple[str, ...], orders: tuple[str, ...], tilts: bool, angles: bool
) -> str:
    def quoted(names: tuple[str, ...]) -> str:
        return ", ".join(f'"{name}"' for name in names)

    scenario = sd.parse_scenario(
        SCENARIO.format(
            lines=quoted(lines),
            scale_lines=quoted(scale_lines),
            orders=quoted(orders),
            tilts=str(tilts).lower(),
            angles="free" if angles else "fixed",
            laser='"free"' if tilts and lines != FACE else LASER,
        )
    )
    calibration = sd.observe(scenario)[1].calibration
    whole, shapes, parts = sd.methods.extents(calibration, scenario.known.plan)
    largest = sd.largest_uncertainties(calibration)
    sizes = [
        f"{sd.in_report_units(kind, largest[kind][0]):.2g}" if kind in largest else "-"
        for kind in ("positioning", "straightness", "angle", "squareness")
    ]
    wanted = 21 if angles else 12
    determined = "all" if len(whole) == wanted else " ".join(whole) or "-"
    return " | ".join([determined, " ".join(shapes) or "-", " ".join(parts) or "-", *sizes])


def main() -> None:
    print("| Readings | Determined | but for a slope | at some nodes | EXX µm | EXY µm | EAX µrad | C0Y µrad |")
    print("|---|---|---|---|---|---|---|---|")
    for name, variant in VARIANTS.items():
        print(f"| {name} | {row(*variant)} |")


if __name__ == "__main__":
    main()
