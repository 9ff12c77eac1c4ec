"""Head descriptions: TOML files that list the bodies, beams and sensors of a head.

docs/head.md describes every key. Two descriptions come with the package and are found by name.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.resources import files as resource_files
from os import PathLike
from pathlib import Path
from typing import Any, Final

from stepdiag import _core
from stepdiag._core import InvalidArgument
from stepdiag.config.body_keys import (
    BodyKeys,
    CornerCubeKeys,
    CubeSplitterKeys,
    GlassKeys,
    MirrorKeys,
    Placed,
    PlateKeys,
    PolyhedronKeys,
    RightAnglePrismKeys,
    ScreenKeys,
    WedgeKeys,
)
from stepdiag.config.head_keys import (
    INTERFEROMETER_KEYS,
    MOST_PIXELS_OF_A_FRAME,
    SPOT_KEYS,
    BeamKeys,
    CameraKeys,
    HeadFile,
    LateralEffectKeys,
    SensorKeys,
)
from stepdiag.config.key_errors import show, suggest
from stepdiag.config.toml_text import check_keys, located, parse_toml
from stepdiag.io.whole_files import read_text
from stepdiag.units import MICROMETRE, MILLIRADIAN, NANOMETRE, PPM
from stepdiag.wrong_arguments import checked

ROOM: Final = 100.0  # mm between a head and its mirror where no scenario gives the distance
FOLDER: Final = Path(str(resource_files("stepdiag.head") / "shipped"))


def shipped_heads() -> list[str]:
    """The names of the heads that come with the package."""
    return sorted(file.stem for file in FOLDER.glob("*.toml"))


@checked
def shipped_head(name: str) -> _core.HeadDesign:
    """Return a head that comes with the package: "three_beams" or "beam_and_psd".

    Raises InvalidArgument for another name."""
    return read_head_design(find_shipped_head(name))


def find_head(name: str, folder: str | PathLike[str] = ".") -> Path:
    """The file of a head: a shipped one by name, otherwise a path relative to `folder`."""
    if name.endswith(".toml") or "/" in name:
        return Path(folder) / name
    return find_shipped_head(name)


def find_shipped_head(name: str) -> Path:
    """The file of a shipped head. Raises InvalidArgument for another name."""
    if name not in shipped_heads():
        raise InvalidArgument(
            f"expected the name of a shipped head ({', '.join(shipped_heads())}) or the path of a TOML file, "
            f"got {show(name)}"
        )
    return FOLDER / f"{name}.toml"


@checked
def read_head_design(path: str | PathLike[str]) -> _core.HeadDesign:
    """Read and check a head description (TOML).

    Raises InvalidArgument naming the file, and the line or key."""
    return parse_head_design(read_text(Path(path)), path)


@checked
def parse_head_design(text: str, path: str | PathLike[str] = "head.toml") -> _core.HeadDesign:
    """Parse and check the text of a head description; `path` names it in messages.

    Raises InvalidArgument naming `path`, and the line or key."""
    file = str(path)
    keys = parse_head_keys(text, path)
    bodies = [_located(_body, f"{file}: body.{name}", name, body) for name, body in keys.body.items()]
    beams = [_located(_beam, f"{file}: beam.{name}", name, beam) for name, beam in keys.beam.items()]
    sensors = [_located(_sensor, f"{file}: sensor.{name}", name, sensor) for name, sensor in keys.sensor.items()]
    with located(file), _beam_named(keys):
        design = _core.HeadDesign(
            keys.name,
            keys.layout,
            bodies,
            beams,
            sensors,
            most_hits=keys.limits.most_hits,
            least_power=keys.limits.least_power,
        )
        before_the_head(design)  # checks the beams together: all on one line are refused
    return design


def reach(design: _core.HeadDesign) -> float:
    """How far the head extends beyond its reference plane, mm. The mirror must be farther away."""
    return max([0.0, *(float(outline[:, 2].max()) for body in design.bodies for outline in body.outlines)])


def before_the_head(design: _core.HeadDesign, mirror: tuple[float, float] | None = None) -> _core.Head:
    """A head without a scenario, whose mirror may be as near as the head reaches."""
    return _core.Head.from_design(design, standoff=reach(design) + ROOM, mirror=mirror)


def parse_head_keys(text: str, path: str | PathLike[str] = "head.toml") -> HeadFile:
    """Parse the keys of a description; each is checked by itself."""
    file = str(path)
    content = parse_toml(text, file)
    if not content:
        raise InvalidArgument(f"{file}: has no keys; expected name, layout, [beam.NAME] and [body.NAME]")
    keys = check_keys(content, HeadFile, file)
    _check_names(keys, file)
    for name, beam in keys.beam.items():
        _check_beam(name, beam, keys, file)
    return keys


def _check_names(keys: HeadFile, file: str) -> None:
    taken: dict[str, str] = {}
    for kind, named in (("beam", keys.beam), ("body", keys.body), ("sensor", keys.sensor)):
        for name in named:
            if not name.strip():
                raise InvalidArgument(f"{file}: {kind}: expected a name, got {show(name)}")
            if name in taken:
                raise InvalidArgument(f"{file}: {kind}.{name}: the name is taken by {taken[name]}; expected another")
            taken[name] = f"{kind}.{name}"


def _check_beam(name: str, beam: BeamKeys, keys: HeadFile, file: str) -> None:
    unfit = INTERFEROMETER_KEYS if beam.sensor is not None else SPOT_KEYS
    whose = "an interferometer; this beam has a sensor" if beam.sensor is not None else "a laser with a sensor"
    for key in unfit:
        if key in beam.model_fields_set:
            raise InvalidArgument(f"{file}: beam.{name}.{key}: is a key of {whose}")
    if beam.sensor is not None and beam.sensor not in keys.sensor:
        known = suggest(beam.sensor, list(keys.sensor)) if keys.sensor else "there is no [sensor.NAME]"
        raise InvalidArgument(
            f"{file}: beam.{name}.sensor: expected the name of a sensor, got {show(beam.sensor)}; {known}"
        )


@contextmanager
def _beam_named(keys: HeadFile) -> Iterator[None]:
    """Add the beam's name to errors about wavelengths, which glass and air raise without it."""
    try:
        yield
    except InvalidArgument as error:
        for name, beam in keys.beam.items():
            if "wavelength in nm: " in str(error) and str(error).endswith(f", got {beam.wavelength_nm:f}"):
                raise InvalidArgument(f"beam.{name}: {error}") from None
        raise


def _located(make: Callable[[str, Any], Any], place: str, name: str, keys: Placed) -> Any:
    with located(place):
        return make(name, keys)


def _place(keys: Placed) -> dict[str, Any]:
    if keys.rotation_deg is not None and keys.rotation_mrad is not None:
        raise InvalidArgument("expected rotation_deg or rotation_mrad, got both")
    rotation = tuple(math.radians(angle) for angle in keys.rotation_deg or (0.0, 0.0, 0.0))
    if keys.rotation_mrad is not None:
        rotation = tuple(angle * MILLIRADIAN for angle in keys.rotation_mrad)
    return {"position": keys.position_mm, "rotation": rotation}


def _body(name: str, keys: BodyKeys) -> _core.HeadBody:
    place = _place(keys)
    if isinstance(keys, GlassKeys):
        place |= {"material": keys.material, "reflectance": keys.reflectance}
    make = _core.HeadBody
    match keys:
        case PlateKeys():
            return make.plate(name, width=keys.width_mm, height=keys.height_mm, thickness=keys.thickness_mm, **place)
        case WedgeKeys():
            return make.wedge(
                name,
                width=keys.width_mm,
                height=keys.height_mm,
                thickness=keys.thickness_mm,
                angle=math.radians(keys.angle_deg),
                **place,
            )
        case CubeSplitterKeys():
            return make.cube_splitter(
                name,
                edge=keys.edge_mm,
                material=keys.material,
                reflectance=keys.reflectance,
                absorptance=keys.absorptance,
                **place,
            )
        case RightAnglePrismKeys():
            return make.right_angle_prism(name, side=keys.side_mm, height=keys.height_mm, **place)
        case CornerCubeKeys():
            return make.corner_cube(name, depth=keys.depth_mm, **place)
        case PolyhedronKeys():
            return make.polyhedron(name, corners=keys.corners_mm, faces=[list(face) for face in keys.faces], **place)
        case MirrorKeys():
            return make.mirror(name, width=keys.width_mm, height=keys.height_mm, reflectance=keys.reflectance, **place)
        case ScreenKeys():
            return make.screen(name, width=keys.width_mm, height=keys.height_mm, **place)
    raise AssertionError(f"no body is made of {type(keys).__name__}")


def _beam(name: str, keys: BeamKeys) -> _core.HeadBeam:
    common: Mapping[str, Any] = {
        **_place(keys),
        "wavelength": keys.wavelength_nm,
        "waist_radius": keys.waist_radius_mm,
        "waist_position": keys.waist_position_mm,
    }
    if keys.sensor is not None:
        return _core.HeadBeam.spot(name, sensor=keys.sensor, housing=keys.housing_mm, **common)
    return _core.HeadBeam.interferometer(
        name,
        **common,
        aperture=keys.aperture_mm,
        acceptance=keys.acceptance_mrad * MILLIRADIAN,
        least_coupling=keys.least_coupling,
        resolution=keys.resolution_nm * NANOMETRE,
        periodic_amplitude=keys.periodic_amplitude_nm * NANOMETRE,
        dead_path=keys.dead_path_mm,
        index_error=keys.index_error_ppm * PPM,
        reading_model=keys.reading_model,
    )


def _sensor(name: str, keys: SensorKeys) -> _core.SpotSensor:
    place = _place(keys)
    match keys:
        case LateralEffectKeys():
            return _core.SpotSensor.lateral_effect(
                name,
                **place,
                size=keys.size_mm,
                noise=keys.noise_um * MICROMETRE,
                resolution=keys.resolution_um * MICROMETRE,
                least_power=keys.least_power,
            )
        case CameraKeys():
            if keys.columns * keys.rows > MOST_PIXELS_OF_A_FRAME:
                raise InvalidArgument(
                    f"expected columns times rows of at most {MOST_PIXELS_OF_A_FRAME} pixels, "
                    f"got {keys.columns} x {keys.rows}"
                )
            return _core.SpotSensor.camera(
                name,
                **place,
                pixel=keys.pixel_um * MICROMETRE,
                columns=keys.columns,
                rows=keys.rows,
                electrons=keys.electrons,
                background=keys.background,
                read_noise=keys.read_noise,
                shot_noise=keys.shot_noise,
                full_well=keys.full_well,
                bits=keys.bits,
                centroid=keys.centroid,
                threshold=keys.threshold,
            )
    raise AssertionError(f"no sensor is made of {type(keys).__name__}")
