"""Renders a plan of `restir export-plan --to wgsl` by WebGPU, and writes the image as a PFM file.

    pip install wgpu numpy
    python run_plan.py FOLDER IMAGE.pfm [--set FIELD=NUMBER ...]

--set writes another number into all parameters of that name, as in `--set seed=7`, or of that whole name, as in `--set reuse.seed=7`.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import wgpu


def open_device():
    """The first adapter, hardware before software, with all of its limits."""
    adapters = wgpu.gpu.enumerate_adapters_sync()
    if not adapters:
        sys.exit("error: there is no adapter; install a driver, such as Mesa's")
    adapter = min(adapters, key=lambda adapter: adapter.info["adapter_type"] == "CPU")
    print("device:", adapter.info["device"], file=sys.stderr)
    names = ["max-storage-buffers-per-shader-stage", "max-storage-buffer-binding-size", "max-buffer-size"]
    return adapter.request_device_sync(required_limits={name: adapter.limits[name] for name in names})


def is_named(path, name):
    return path == name or path.split(".")[-1] == name


def word(number, field):
    """The number as a parameter holds it."""
    if field["count"] != 1:
        sys.exit(f"error: {field['name']} has {field['count']} numbers; --set writes parameters of one")
    if field["type"] == "f32":
        return np.float32(number).view("u4")
    if number != int(number) or not 0 <= number < 2**32:
        sys.exit(f"error: {field['name']} has to be a whole number from 0 to {2**32 - 1}")
    return np.uint32(number)


class Kernel:
    def __init__(self, device, folder, entry):
        if "wgsl" not in entry["modules"]:
            sys.exit("error: the plan has no WGSL; export it with --to wgsl")
        module = entry["modules"]["wgsl"]
        self.bindings = [binding["name"] for binding in entry["bindings"]]
        self.fields = {field["name"]: field for field in entry["params"]}
        layouts = [
            {
                "binding": index,
                "visibility": wgpu.ShaderStage.COMPUTE,
                "buffer": {"type": "storage" if binding["writes"] else "read-only-storage"},
            }
            for index, binding in enumerate(entry["bindings"])
        ]
        self.layout = device.create_bind_group_layout(entries=layouts)
        shader = device.create_shader_module(code=(folder / module["file"]).read_text())
        self.pipeline = device.create_compute_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[self.layout]),
            compute={"module": shader, "entry_point": module["entry"]},
        )


class Pass:
    """A pass, which is dispatched once in each frame in which it runs."""

    def __init__(self, device, kernels, entry, settings):
        self.entry, self.kernel, self.times = entry, kernels[entry["kernel"]], 0
        self.settings = [
            (field["byte"] // 4, word(number, field))
            for name, number in settings.items()
            for path, field in self.kernel.fields.items()
            if is_named(path, name)
        ]
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST
        self.block = device.create_buffer(size=4 * len(entry["params"]), usage=usage)

    def runs_in(self, frame):
        return any(first <= frame <= last for first, last in self.entry["frames"])

    def params(self):
        """The words of its parameters, this time."""
        words = np.array(self.entry["params"], "u4")
        for change in self.entry["changes"]:
            values = change["values"][self.times % len(change["values"])]
            first = change["byte"] // 4
            words[first : first + len(values)] = values
        for word, number in self.settings:
            words[word] = number
        return words

    def record(self, device, encoder, buffers):
        device.queue.write_buffer(self.block, 0, self.params())
        bound = [self.block]
        for role in self.kernel.bindings[1:]:
            ids = self.entry["buffers"][role]
            bound.append(buffers[ids[self.times % len(ids)]])
        entries = [
            {"binding": index, "resource": {"buffer": buffer, "offset": 0, "size": buffer.size}}
            for index, buffer in enumerate(bound)
        ]
        commands = encoder.begin_compute_pass()
        commands.set_pipeline(self.kernel.pipeline)
        commands.set_bind_group(0, device.create_bind_group(layout=self.kernel.layout, entries=entries))
        commands.dispatch_workgroups(*self.entry["workgroups"])
        commands.end()
        self.times += 1


def open_buffer(device, folder, entry):
    usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.COPY_SRC
    if "file" in entry:
        return device.create_buffer_with_data(data=(folder / entry["file"]).read_bytes(), usage=usage)
    return device.create_buffer(size=entry["bytes"], usage=usage)


def render(folder, settings):
    """The image: rows from the top, linear red, green and blue."""
    plan = json.loads((folder / "plan.json").read_text())
    if (plan["format"], plan["version"]) != ("restir-plan", 1):
        sys.exit("error: plan.json is of another version")
    device = open_device()
    buffers = [open_buffer(device, folder, entry) for entry in plan["buffers"]]
    kernels = [Kernel(device, folder, entry) for entry in plan["kernels"]]
    passes = [Pass(device, kernels, entry, settings) for entry in plan["passes"]]
    paths = [path for kernel in kernels for path in kernel.fields]
    missing = [name for name in settings if not any(is_named(path, name) for path in paths)]
    if missing:
        sys.exit(f"error: no kernel has a parameter {missing[0]}; plan.json lists them")
    files = {upload["file"]: (folder / upload["file"]).read_bytes() for upload in plan["uploads"]}
    for frame in range(plan["frames"]):
        for upload in (upload for upload in plan["uploads"] if upload["frame"] == frame):
            part = files[upload["file"]][upload["at"] : upload["at"] + upload["bytes"]]
            device.queue.write_buffer(buffers[upload["buffer"]], upload["byte"], part)
        # what is written to buffers comes before the commands of the frame
        encoder = device.create_command_encoder()
        for each in passes:
            if each.runs_in(frame):
                each.record(device, encoder, buffers)
        device.queue.submit([encoder.finish()])
    width, height = plan["size"]
    words = device.queue.read_buffer(buffers[plan["outputs"][0]["buffer"]])
    return np.frombuffer(words, "<f4").reshape(height, width, 4)[..., :3]


def write_pfm(path, image):
    """Rows go up in a PFM file."""
    height, width, _ = image.shape
    path.write_bytes(b"PF\n%d %d\n-1.0\n" % (width, height) + image[::-1].astype("<f4").tobytes())


def setting(text):
    name, _, number = text.partition("=")
    return name, float(number)


def main():
    parser = argparse.ArgumentParser(description="Renders a plan of restir export-plan --to wgsl.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("image", type=Path)
    parser.add_argument("--set", action="append", type=setting, default=[], metavar="FIELD=NUMBER")
    arguments = parser.parse_args()
    write_pfm(arguments.image, render(arguments.folder, dict(arguments.set)))


if __name__ == "__main__":
    main()
