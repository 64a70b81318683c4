#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""VGGT in PyTorch, and the same module through ONNX Runtime: the peers of bench/vggt_bench. Cameras and depth, on the
processor. Written from our own network (src/vggtcd/vggt); tensors have the upstream names.

  vggt_peer.py torch WEIGHTS --views N --size WxH [--precision bf16] [--attention plain] [--products onednn]
                      [--answer OUT.npz]
  vggt_peer.py export WEIGHTS MODEL.onnx --views N --size WxH      the module as a graph; weights in MODEL.onnx.data
  vggt_peer.py onnxruntime MODEL.onnx --views N --size WxH [--answer OUT.npz]
  vggt_peer.py compare OURS.npz ANSWER.npz...                      how far each answer is from ours

--precision bf16: under PyTorch's autocast, with the weights of what it rounds kept in bf16. As in ours the patch
projection, the camera head and the last convolution are in f32.
--attention fused (the default): PyTorch's scaled_dot_product_attention, ONNX Runtime's MultiHeadAttention; plain: two
products and a softmax, which store a matrix of tokens by tokens.
--products onednn: PyTorch's linear layers in f32 by oneDNN instead of MKL, which is not at its best on AMD.
"""
import argparse
import contextlib
import json
import math
import os
import pathlib
import time

import numpy as np

IMAGE_MEAN, IMAGE_STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
VIT_EPS, EPS, ADAPTIVE_EPS = 1e-6, 1e-5, 1e-6
PATCH = 14
DEFAULTS = {"num_heads": 16, "vit_num_heads": 16, "camera_num_heads": 16, "camera_num_iterations": 4,
            "dpt_layers": [4, 11, 17, 23], "rope_freq": 100.0}


# --- Files, pictures, measuring: numpy only. ---

def read_header(path):
    """Of a safetensors file: {name: (shape, offset in the file)} of the tensors, and the network's config."""
    with open(path, "rb") as file:
        size = int.from_bytes(file.read(8), "little")
        header = json.loads(file.read(size))
    config = DEFAULTS | json.loads(header.pop("__metadata__", {}).get("config", "{}"))
    assert all(entry["dtype"] == "F32" for entry in header.values()), f"{path}: expected f32 tensors"
    return {name: (entry["shape"], 8 + size + entry["data_offsets"][0]) for name, entry in header.items()}, config


def make_images(views, height, width):
    """As vggt_bench makes them: smooth, and different from view to view."""
    i = np.arange(views * 3 * height * width) % 100003
    return (np.float32(0.5) + np.float32(0.4) * np.sin(i.astype(np.float32) * np.float32(0.013))).reshape(
        views, 3, height, width)


def reset_peak_memory():
    pathlib.Path("/proc/self/clear_refs").write_text("5")


def peak_memory_gb():
    status = pathlib.Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) * 1024e-9


def relative_l2(a, b):
    a, b = a.astype(np.float64).ravel(), b.astype(np.float64).ravel()
    return np.linalg.norm(a - b) / np.linalg.norm(b)


def compare(ours_path, answer_paths):
    """A line for each answer: relative L2 of pose encoding, depth and confidence."""
    ours = np.load(ours_path)
    for path in answer_paths:
        answer = np.load(path)
        print(*(f"{relative_l2(answer[key], ours[key]):.1e}" for key in ("pose_enc", "depth", "depth_conf")))


# --- Embeddings of position. ---

def bicubic_weights(size, out):
    """[out, size]: bicubic resampling with a = -0.5, antialiased, windows clipped at the border and normalised."""
    def cubic(x):
        x = np.abs(x)
        return np.where(x < 1, (1.5 * x - 2.5) * x * x + 1, np.where(x < 2, ((-0.5 * x + 2.5) * x - 4) * x + 2, 0))
    scale = size / out
    stretch = max(scale, 1.0)
    centre = scale * (np.arange(out)[:, None] + 0.5)
    j = np.arange(size)[None, :]
    first = np.maximum(0, (centre - 2 * stretch + 0.5).astype(int))
    end = np.minimum(size, (centre + 2 * stretch + 0.5).astype(int))
    weights = np.where((j >= first) & (j < end), cubic((j - centre + 0.5) / stretch), 0.0)
    return weights / weights.sum(axis=1, keepdims=True)


def position_grid(stored, height, width):
    """The ViT's positions [1, 1 + side^2, C] for height x width patches: [1, 1 + height * width, C]."""
    side = math.isqrt(stored.shape[1] - 1)
    if (height, width) == (side, side):
        return stored
    grid = stored[0, 1:].reshape(side, side, -1).astype(np.float64)
    grid = np.einsum("hi,ijc,wj->hwc", bicubic_weights(side, height), grid, bicubic_weights(side, width), optimize=True)
    return np.concatenate([stored[0, :1], grid.reshape(height * width, -1)])[None].astype(np.float32)


def rope_table(special, height, width, head_dim, base):
    """cos and sin [N, 1, head_dim]: the first half of the channels turns by y, the second by x; the special tokens are
    at (0, 0), the patches at (y + 1, x + 1). sin carries the sign of the rotation's first or second component."""
    y, x = np.divmod(np.arange(height * width), width)
    positions = np.concatenate([np.zeros((special, 2)), np.stack([y + 1, x + 1], axis=1)])
    quarter = head_dim // 4
    angle = positions[:, :, None, None] * (base ** (-np.arange(quarter) / quarter))  # [N, 2, 1, quarter]
    cos = np.concatenate([np.cos(angle)] * 2, axis=2)
    sin = np.concatenate([-np.sin(angle), np.sin(angle)], axis=2)
    return [table.reshape(-1, 1, head_dim).astype(np.float32) for table in (cos, sin)]


def dpt_waves(map_height, map_width, channels, height, width):
    """[1, channels, map_height, map_width]: 0.1 * (sin, cos of x; sin, cos of y) at channels / 4 frequencies."""
    quarter = channels // 4
    frequency = 100.0 ** (-np.arange(quarter) / quarter)

    def waves(size, extent):
        angle = frequency[:, None] * (extent * (2 * np.arange(size) - (size - 1)) / size)
        return 0.1 * np.concatenate([np.sin(angle), np.cos(angle)])
    shape = (channels // 2, map_height, map_width)
    diagonal = math.hypot(height, width)
    x = np.broadcast_to(waves(map_width, width / diagonal)[:, None, :], shape)
    y = np.broadcast_to(waves(map_height, height / diagonal)[:, :, None], shape)
    return np.concatenate([x, y])[None].astype(np.float32)


# --- The network. ---

def is_rounded(name, shape):
    """Whether a tensor is a matrix that --precision bf16 rounds."""
    in_f32 = ("camera_head.", "aggregator.patch_embed.patch_embed.", "depth_head.scratch.output_conv2.2.")
    return name.endswith(".weight") and len(shape) > 1 and not name.startswith(in_f32)


def make_network(weights_path, views, height, width, mapped=False, attention="fused", bf16=False, onednn=False):
    """The module with its weights; mapped: they stay in the file. attention: fused, fused_onnx (an operator of ONNX
    Runtime) or plain."""
    import torch
    import torch.nn.functional as F

    class Scope(torch.nn.Module):
        """Modules and parameters by the dots of their names."""

        def put(self, name, value):
            head, _, rest = name.partition(".")
            if not rest:
                self.register_parameter(head, torch.nn.Parameter(value, requires_grad=False))
                return
            if head not in self._modules:
                self.add_module(head, Scope())
            self._modules[head].put(rest, value)

        def __getitem__(self, number):
            return self._modules[str(number)]

        def __len__(self):
            return len(self._modules)

    def linear(scope, x):
        if onednn:
            return torch.ops.mkldnn._linear_pointwise(x.contiguous(), scope.weight, scope.bias, "none", [], "")
        return F.linear(x, scope.weight, scope.bias)

    def norm(scope, x, eps):
        return F.layer_norm(x, x.shape[-1:], scope.weight, scope.bias, eps)

    def conv(scope, x, stride=1):
        return F.conv2d(x, scope.weight, getattr(scope, "bias", None), stride, padding=scope.weight.shape[-1] // 2)

    def rotate(x, cos, sin):
        first, second = x.unflatten(-1, (2, 2, -1)).split(1, -2)
        return x * cos + torch.cat([second, first], -2).flatten(-3) * sin

    def full_precision():
        return torch.autocast("cpu", enabled=False) if bf16 else contextlib.nullcontext()

    def attend(q, k, v):
        """softmax(q k^T / sqrt(D)) v, all [B, N, heads, D] -> [B, N, heads * D]."""
        if attention == "fused_onnx":  # never stores N x N scores
            heads = q.shape[2]
            q, k, v = (t.flatten(2) for t in (q, k, v))
            return torch.onnx.ops.symbolic("com.microsoft::MultiHeadAttention", (q, k, v), {"num_heads": heads},
                                           dtype=q.dtype, shape=q.shape, version=1)
        q, k, v = (t.transpose(1, 2) for t in (q, k, v))
        if attention == "fused":
            out = F.scaled_dot_product_attention(q, k, v)
        else:
            out = torch.softmax((q * q.shape[-1] ** -0.5) @ k.transpose(-2, -1), -1) @ v
        return out.transpose(1, 2).flatten(2)

    def block(scope, x, heads, eps, rope=None, across=False):
        """x [B, N, C]; across: all B sequences attend as one."""
        b, n, c = x.shape
        qkv = linear(scope.attn.qkv, norm(scope.norm1, x, eps)).view(b, n, 3, heads, c // heads)
        q, k, v = qkv.unbind(2)
        if rope is not None:
            q = rotate(norm(scope.attn.q_norm, q, EPS), *rope)
            k = rotate(norm(scope.attn.k_norm, k, EPS), *rope)
        if across:
            q, k, v = (t.reshape(1, b * n, heads, c // heads) for t in (q, k, v))
        attended = attend(q, k, v).view(b, n, c)
        x = torch.addcmul(x, scope.ls1.gamma, linear(scope.attn.proj, attended))
        hidden = F.gelu(linear(scope.mlp.fc1, norm(scope.norm2, x, eps)))
        return torch.addcmul(x, scope.ls2.gamma, linear(scope.mlp.fc2, hidden))

    def residual_unit(scope, x):
        x = F.relu(x)  # upstream in place: the skip connection has it too
        return x + conv(scope.conv2, F.relu(conv(scope.conv1, x)))

    def resize(x, size):
        return F.interpolate(x, size=size, mode="bilinear", align_corners=True)

    class Vggt(Scope):
        def __init__(self):
            super().__init__()
            tensors, self.config = read_header(weights_path)
            for name, (shape, offset) in tensors.items():
                if name.startswith(("point_head.", "track_head.")):
                    continue
                read = (np.memmap(weights_path, np.float32, "c", offset, tuple(shape)) if mapped else
                        np.fromfile(weights_path, np.float32, math.prod(shape), offset=offset).reshape(shape))
                tensor = torch.from_numpy(read)
                self.put(name, tensor.bfloat16() if bf16 and is_rounded(name, shape) else tensor)
            self.grid = height // PATCH, width // PATCH
            self.special = 1 + self.aggregator.register_token.shape[2]
            self.add_constants()

        def add_constants(self):
            def put(name, value):
                self.register_buffer(name, torch.from_numpy(np.ascontiguousarray(value)), persistent=False)
            vit = self.aggregator.patch_embed
            put("positions", position_grid(vit.pos_embed.numpy(), *self.grid))
            head_dim = self.aggregator.camera_token.shape[-1] // self.config["num_heads"]
            cos, sin = rope_table(self.special, *self.grid, head_dim, self.config["rope_freq"])
            put("rope_cos", cos)
            put("rope_sin", sin)
            put("mean", np.array(IMAGE_MEAN, np.float32).reshape(3, 1, 1))
            put("std", np.array(IMAGE_STD, np.float32).reshape(3, 1, 1))
            for level in range(4):
                channels = self.depth_head.projects[level].weight.shape[0]
                put(f"waves{level}", dpt_waves(*self.grid, channels, height, width))
            put("waves", dpt_waves(height, width, self.depth_head.scratch.output_conv1.weight.shape[0], height, width))

        def patch_tokens(self, images):
            vit, heads = self.aggregator.patch_embed, self.config["vit_num_heads"]
            projection = vit.patch_embed.proj
            with full_precision():
                x = F.conv2d((images - self.mean) / self.std, projection.weight, projection.bias, stride=PATCH)
            x = x.flatten(2).transpose(1, 2)  # [S, C, h, w] -> [S, P, C]
            x = torch.cat([vit.cls_token.expand(views, -1, -1), x], 1) + self.positions
            x = torch.cat([x[:, :1], vit.register_tokens.expand(views, -1, -1), x[:, 1:]], 1)
            for i in range(len(vit.blocks)):
                x = block(vit.blocks[i], x, heads, VIT_EPS)
            return norm(vit.norm, x[:, 1 + vit.register_tokens.shape[1]:], VIT_EPS)

        def aggregate(self, images):
            """What the heads read: four times [S, special + P, 2C]."""
            scope, heads, rope = self.aggregator, self.config["num_heads"], (self.rope_cos, self.rope_sin)
            special = torch.cat([scope.camera_token, scope.register_token], 2)[0]  # [2, special, C]: first view, others
            special = torch.cat([special[:1], special[1:].expand(views - 1, -1, -1)])
            x = torch.cat([special, self.patch_tokens(images)], 1)
            kept = []
            for i in range(len(scope.frame_blocks)):
                frame = x = block(scope.frame_blocks[i], x, heads, EPS, rope)
                x = block(scope.global_blocks[i], x, heads, EPS, rope, across=True)
                if i in self.config["dpt_layers"]:
                    kept.append(torch.cat([frame, x], -1))
            return kept

        def cameras(self, tokens):
            head = self.camera_head
            camera = norm(head.token_norm, tokens[:, 0], EPS)
            pose = head.empty_pose_tokens[0].expand(views, -1)
            for iteration in range(self.config["camera_num_iterations"]):
                embedded = F.silu(linear(head.embed_pose, pose))
                shift, scale, gate = linear(head.poseLN_modulation[1], embedded).chunk(3, -1)
                normal = F.layer_norm(camera, camera.shape[-1:], eps=ADAPTIVE_EPS)
                x = (camera + gate * (normal * (1 + scale) + shift))[None]
                for i in range(len(head.trunk)):
                    x = block(head.trunk[i], x, self.config["camera_num_heads"], EPS)
                x = norm(head.trunk_norm, x[0], EPS)
                delta = linear(head.pose_branch.fc2, F.gelu(linear(head.pose_branch.fc1, x)))
                pose = delta if iteration == 0 else pose + delta
            return torch.cat([pose[:, :7], F.relu(pose[:, 7:])], -1)

        def depth_of_view(self, kept, view):
            """[1, 2, H, W]. One view at a time: memory does not grow with their number."""
            head, net = self.depth_head, self.depth_head.scratch
            layers = []
            for level in range(4):
                x = norm(head.norm, kept[level][view:view + 1, self.special:], EPS)
                x = x.transpose(1, 2).unflatten(2, self.grid)  # [1, P, 2C] -> [1, 2C, h, w]
                x = conv(head.projects[level], x) + getattr(self, f"waves{level}")
                if level < 2:
                    up = head.resize_layers[level]
                    x = F.conv_transpose2d(x, up.weight, up.bias, stride=up.weight.shape[-1])
                elif level == 3:
                    x = conv(head.resize_layers[3], x, stride=2)
                layers.append(conv(getattr(net, f"layer{level + 1}_rn"), x))
            path = None
            for level in (3, 2, 1, 0):
                unit = getattr(net, f"refinenet{level + 1}")
                path = layers[level] if path is None else path + residual_unit(unit.resConfUnit1, layers[level])
                path = residual_unit(unit.resConfUnit2, path)
                size = layers[level - 1].shape[-2:] if level else [2 * n for n in path.shape[-2:]]
                path = resize(conv(unit.out_conv, path), size)  # the 1x1 first: the same, a quarter of the work
            x = resize(conv(net.output_conv1, path), (height, width)) + self.waves
            x = F.relu(conv(net.output_conv2[0], x))
            with full_precision():
                return conv(net.output_conv2[2], x.float())

        def forward(self, images):
            kept = self.aggregate(images)
            with full_precision():
                pose = self.cameras(kept[-1])
            raw = torch.cat([self.depth_of_view(kept, view) for view in range(views)])
            return pose, torch.exp(raw[:, 0]), 1 + torch.exp(raw[:, 1])

    return Vggt().eval()


# --- The engines. ---

def measure(call, load_seconds, answer_path):
    """One pass: prints its time and the peak of memory meanwhile, and writes the answer."""
    print(f"loading {load_seconds:.2f} s, peak memory while loading {peak_memory_gb():.2f} GB")
    reset_peak_memory()
    start = time.perf_counter()
    answer = call()
    print(f"time {time.perf_counter() - start:.2f} s")
    print(f"peak memory {peak_memory_gb():.2f} GB", flush=True)
    if answer_path:
        np.savez(answer_path, **dict(zip(("pose_enc", "depth", "depth_conf"), map(np.asarray, answer))))


def run_torch(arguments):
    import torch
    torch.set_num_threads(os.cpu_count())
    bf16 = arguments.precision == "bf16"
    start = time.perf_counter()
    network = make_network(arguments.model, arguments.views, arguments.height, arguments.width,
                           attention=arguments.attention, bf16=bf16, onednn=arguments.products == "onednn")
    images = torch.from_numpy(make_images(arguments.views, arguments.height, arguments.width))
    level = torch.backends.cpu.get_cpu_capability().lower() + ("bf16" if bf16 else "")
    print(f"PyTorch {torch.__version__}, {arguments.attention} attention, products {arguments.products}")
    print(f"precision {arguments.precision} on {level}, {torch.get_num_threads()} threads")
    with torch.inference_mode(), torch.autocast("cpu", torch.bfloat16, enabled=bf16):
        measure(lambda: network(images), time.perf_counter() - start, arguments.answer)


def run_onnxruntime(arguments):
    import onnxruntime
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = os.cpu_count()
    start = time.perf_counter()
    session = onnxruntime.InferenceSession(arguments.model, options, providers=["CPUExecutionProvider"])
    images = make_images(arguments.views, arguments.height, arguments.width)
    print(f"ONNX Runtime {onnxruntime.__version__}")
    print(f"precision f32 on what the processor has, {options.intra_op_num_threads} threads")
    measure(lambda: session.run(None, {"images": images}), time.perf_counter() - start, arguments.answer)


def export(arguments):
    """The graph, and its weights in a file beside it."""
    import torch
    network = make_network(arguments.weights, arguments.views, arguments.height, arguments.width, mapped=True,
                           attention="fused_onnx" if arguments.attention == "fused" else "plain")
    images = torch.from_numpy(make_images(arguments.views, arguments.height, arguments.width))
    with torch.inference_mode():
        program = torch.onnx.export(network, (images,), dynamo=True, input_names=["images"],
                                    output_names=["pose_enc", "depth", "depth_conf"], verbose=False)
    program.save(arguments.model, external_data=True)
    print(f"opset {program.model.opset_imports['']}, {len(list(program.model.graph))} nodes, "
          f"peak memory {peak_memory_gb():.2f} GB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name, *positional):
        added = commands.add_parser(name)
        for argument in positional:
            added.add_argument(argument)
        if name != "compare":
            added.add_argument("--views", type=int, default=2)
            added.add_argument("--size", default="518x392", help="WIDTHxHEIGHT, multiples of 14")
        return added
    for name, positional in (("torch", ["model"]), ("export", ["weights", "model"])):
        command(name, *positional).add_argument("--attention", choices=["fused", "plain"], default="fused")
    commands.choices["torch"].add_argument("--precision", choices=["f32", "bf16"], default="f32")
    commands.choices["torch"].add_argument("--products", choices=["auto", "onednn"], default="auto")
    command("onnxruntime", "model")
    for engine in ("torch", "onnxruntime"):
        commands.choices[engine].add_argument("--answer")
    command("compare", "ours").add_argument("answers", nargs="+")
    arguments = parser.parse_args()
    if arguments.command == "compare":
        compare(arguments.ours, arguments.answers)
        return
    arguments.width, arguments.height = map(int, arguments.size.split("x"))
    {"torch": run_torch, "onnxruntime": run_onnxruntime, "export": export}[arguments.command](arguments)


if __name__ == "__main__":
    main()
