#!/usr/bin/env python3
"""Checks the table of docs/conventions.md: which --env-rotation gives the light of a scene in another program.

    pip install numpy mitsuba bpy                  # bpy is Blender as a Python module
    cargo build --release --bin lookalike
    experiments/map_conventions.py [--lookalike PROGRAM] [--work DIR] [--only blender|mitsuba|column]

Renders a mirror sphere under a map of six coloured regions, one for each axis, in Blender (Cycles) and Mitsuba 3 with the camera and
the light turned, and with `lookalike render` at every multiple of 10 degrees. The rotation whose image agrees best must be
the one that the table gives, and the mirrored image must agree far less. `column` checks the rule for a panorama without axes:
a spot is painted into one column, and the sphere must reflect it from its middle.

Prints a line per case; ends with an error if one disagrees. About 3 minutes on two cores.
"""
import argparse
import math
import pathlib
import subprocess

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

ROOT = pathlib.Path(__file__).resolve().parent.parent
SIZE = 128
HEIGHT = 256
# Of the axes +X, -X, +Y, -Y, +Z, -Z of the map as lookalike and OpenEXR place them.
COLOURS = [(1, 0.1, 0.1), (0.1, 1, 1), (1, 1, 1), (0.05, 0.05, 0.05), (0.1, 0.1, 1), (1, 1, 0.1)]
# Noise and the edges of the regions make 4 to 5.5 % between two renderers; a wrong turn of 10 degrees makes 29 % and more.
AGREES = 0.1


def directions(height):
    """Directions of the texels of a lat-long map, height x 2 height x 3."""
    theta = (np.arange(height) + 0.5) / height * np.pi
    u = (np.arange(2 * height) + 0.5) / (2 * height)
    theta, u = np.meshgrid(theta, u, indexing="ij")
    return np.stack([np.sin(theta) * np.sin(2 * np.pi * u), np.cos(theta), -np.sin(theta) * np.cos(2 * np.pi * u)], -1)


def six_colours(path):
    d = directions(HEIGHT)
    axis = np.abs(d).argmax(-1)
    is_negative = np.take_along_axis(d, axis[..., None], -1)[..., 0] < 0
    mi.Bitmap(np.array(COLOURS, np.float32)[2 * axis + is_negative]).write(str(path))


def read(path):
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))


def lookalike(options, light, rotation_deg):
    """A near-mirror sphere under a map that is turned."""
    out = options.work / f"{light.stem}-{rotation_deg:g}.exr"
    mirror = ["--model", "ggx", "--params", "kd=0,f0=1,alpha=.005"]
    turn = ["--env-rotation", rotation_deg, "--size", SIZE, "--samples", 64]
    command = [options.lookalike, "render", *mirror, "--env", light, *turn, "-o", out]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    return read(out)


def blender(light, camera_deg, mapping_deg, vector_type, out):
    """Camera at rotation_euler (90, 0, camera_deg), world light through a Mapping node turned by mapping_deg about Z."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(out)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=1)
    bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new("mirror")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    glossy, output = tree.nodes.new("ShaderNodeBsdfGlossy"), tree.nodes.new("ShaderNodeOutputMaterial")
    glossy.inputs["Roughness"].default_value = 0
    glossy.inputs["Color"].default_value = (1, 1, 1, 1)
    tree.links.new(glossy.outputs[0], output.inputs[0])
    bpy.context.object.data.materials.append(material)
    scene.world = bpy.data.worlds.new("light")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    tree.nodes.clear()
    names = ["TexCoord", "Mapping", "TexEnvironment", "Background", "OutputWorld"]
    coordinates, mapping, texture, background, output = (tree.nodes.new(f"ShaderNode{name}") for name in names)
    mapping.vector_type = vector_type
    mapping.inputs["Rotation"].default_value = (0, 0, math.radians(mapping_deg))
    texture.image = bpy.data.images.load(str(light))
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    for source, target in zip((mapping, texture, background), (texture, background, output)):
        tree.links.new(source.outputs[0], target.inputs[0])
    data = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale = "ORTHO", 2
    camera = bpy.data.objects.new("camera", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    angle = math.radians(camera_deg)
    camera.rotation_euler = (math.pi / 2, 0, angle)
    camera.location = (5 * math.sin(angle), -5 * math.cos(angle), 0)
    bpy.ops.render.render(write_still=True)
    return read(out)


def mitsuba(light, azimuth_deg, light_deg):
    """Camera that looks along (sin, 0, cos) of an azimuth, light with to_world = rotate([0, 1, 0], light_deg)."""
    azimuth = math.radians(azimuth_deg)
    origin = [-5 * math.sin(azimuth), 0, -5 * math.cos(azimuth)]
    transform = mi.ScalarTransform4f
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3, "hide_emitters": True},
        "light": {"type": "envmap", "filename": str(light), "to_world": transform().rotate([0, 1, 0], light_deg)},
        "sphere": {"type": "sphere", "bsdf": {"type": "conductor", "material": "none"}},
        "sensor": {
            "type": "orthographic",
            "to_world": transform().look_at(origin=origin, target=[0, 0, 0], up=[0, 1, 0]),
            "film": {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent", "sample_count": 16},
        },
    })
    return np.array(mi.render(scene))[..., :3]


def difference(a, b):
    """Relative root mean square difference inside the sphere."""
    x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 2 - 1] * 2)
    inside = np.hypot(x, y) < 0.97
    return math.sqrt(np.mean((a - b)[inside] ** 2)) / b[inside].mean()


def judge(case, image, turned, expected_deg):
    """Whether the image is that of the expected rotation; prints what agrees best."""
    differences = {turn: difference(image, other) for turn, other in turned.items()}
    best = min(differences, key=differences.get)
    second = min(value for turn, value in differences.items() if turn != best)
    mirrored = min(difference(image[:, ::-1], other) for other in turned.values())
    is_right = best == expected_deg % 360 and differences[best] < AGREES < min(second, mirrored)
    print(f"{'as said' if is_right else 'WRONG'}: {case}: --env-rotation {expected_deg % 360} expected, {best} agrees best "
          f"({100 * differences[best]:.1f} %; next {100 * second:.0f} %, mirrored {100 * mirrored:.0f} %)", flush=True)
    return is_right


def column(options):
    """A white spot in one column of a grey panorama must come out in the middle of the sphere."""
    is_right = True
    for column in (100, 256, 410):
        panorama = np.full((HEIGHT, 2 * HEIGHT, 3), 0.1, np.float32)
        panorama[HEIGHT // 2 - 6:HEIGHT // 2 + 6, column - 6:column + 6] = 5
        light = options.work / f"spot-{column}.exr"
        mi.Bitmap(panorama).write(str(light))
        rotation = 360 * (column / (2 * HEIGHT) - 0.5)
        image = lookalike(options, light, rotation)[..., 0]
        weight = np.where(image > 1, image, 0)
        rows, columns = np.mgrid[:SIZE, :SIZE] + 0.5
        x, y = (weight * columns).sum() / weight.sum(), (weight * rows).sum() / weight.sum()
        here = abs(x - SIZE / 2) < 0.5 and abs(y - SIZE / 2) < 0.5
        is_right &= bool(here)
        print(f"{'as said' if here else 'WRONG'}: camera in column {column} of {2 * HEIGHT}: --env-rotation {rotation:.4g} "
              f"reflects it at ({x:.2f}, {y:.2f}) of {SIZE}, middle {SIZE / 2}")
    return is_right


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lookalike", type=pathlib.Path, default=ROOT / "target/release/lookalike")
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "target/map-conventions")
    parser.add_argument("--only", choices=["blender", "mitsuba", "column"])
    options = parser.parse_args()
    options.work = options.work.resolve()
    options.work.mkdir(parents=True, exist_ok=True)
    asked = [options.only] if options.only else ["column", "mitsuba", "blender"]
    light = options.work / "six-colours.exr"
    six_colours(light)
    rights = [column(options)] if "column" in asked else []
    turned = {turn: lookalike(options, light, turn) for turn in range(0, 360, 10)} if asked != ["column"] else {}
    if "mitsuba" in asked:
        for azimuth, light_deg in [(180, 0), (180, 40), (130, 0), (130, 40), (0, 0)]:
            image = mitsuba(light, azimuth, light_deg)
            case = f"Mitsuba, view along azimuth {azimuth}, light turned by {light_deg}"
            rights.append(judge(case, image, turned, light_deg + 180 - azimuth))
    if "blender" in asked:
        for camera, mapping, kind in [(0, 0, "POINT"), (40, 0, "POINT"), (0, 30, "POINT"), (40, 30, "POINT"), (0, 30, "TEXTURE")]:
            image = blender(light, camera, mapping, kind, options.work / f"blender-{camera}-{mapping}-{kind}.exr")
            sign = 1 if kind == "TEXTURE" else -1
            case = f"Blender, camera turned by {camera}, Mapping node of type {kind} by {mapping}"
            rights.append(judge(case, image, turned, 90 - camera + sign * mapping))
    if not all(rights):
        raise SystemExit("docs/conventions.md and the programs disagree")


if __name__ == "__main__":
    main()
