# SPDX-License-Identifier: BSD-3-Clause
"""The peers of rasterizers.py: how each is built, and how it renders a frame."""
import importlib
import importlib.util
import os
import re
import shutil
import sys

# The extension's name of each peer, and the folder of its checkout with what is built.
PEERS = {"original": ("original_c", "diff-gaussian-rasterization"),
         "PolySplat": ("polysplat", "PolySplat"),
         "FlashGS": ("flash_gaussian_splatting", "FlashGS"),
         "Faster-GS": ("faster_gs_c", "faster-gaussian-splatting/FasterGSCudaBackend"),
         "HiGS": ("higs_c", "gsplat"),
         "gsplat": ("gsplat_c", "gsplat"),
         "RoofGS": ("roofgs_c", "RoofGS/submodules/diff-gaussian-rasterization")}
# Names that PyTorch 2.11 and CUDA 13 no longer have, in a copy of the sources.
RENAMED = [(r"\.data<", ".data_ptr<"), (r"AT_ERROR\(", "TORCH_CHECK(false, "),
           (r"cub::Max\(\)", "cuda::maximum<>{}"),
           (r"(?s)using DispatchT = .*?SelectedPolicy>\(\);",
            "return cub::DeviceRadixSort::SortPairs(d_temp_storage, temp_storage_bytes, d_keys_in, "
            "d_keys_out, d_values_in, d_values_out, num_items, begin_bit, end_bit, stream);")]


def copy_sources(name, peers, folder):
    source = folder / "source"
    shutil.copytree(peers / PEERS[name][1], source, dirs_exist_ok=True)
    for file in source.rglob("*.cu*") if PEERS[name][1] != "gsplat" else []:
        text = file.read_text()
        for pattern, new in RENAMED:
            text = re.sub(pattern, new, text)
        file.write_text(text)
    return source


def build(name, peers, work):
    """Compiles a peer's extension, with its own flags."""
    from torch.utils import cpp_extension
    folder = work / "builds" / name
    source = copy_sources(name, peers, folder)
    sources = [*source.glob("*.cpp"), *source.glob("csrc/*.cpp"), *source.rglob("*.cu")]
    flags, cxx, link = ["-O3"], ["-O3"], []
    include = [str(peers / "PolySplat/csrc")]  # it carries GLM, which other archives lack
    if name in ("original", "RoofGS"):
        flags += ["-include", "cstdint"]
    elif name == "PolySplat":
        flags += ["--use_fast_math", "--extra-device-vectorization", "-split-compile=0"]
    elif name == "FlashGS":
        flags, cxx = ["-O1", "-Xptxas=-O1"], ["-O1"]
    elif name == "Faster-GS":
        root = source / "FasterGSCudaBackend"
        sources.append(root / "torch_bindings/bindings.cpp")
        include += [str(root / "utils"), *map(str, root.glob("*/include"))]
        flags += ["-use_fast_math", "-include", "cuda/functional"]
    else:  # gsplat and HiGS, its experimental renderer: both know their own flags
        os.environ.update(BUILD_3DGS="1", NUM_CHANNELS="3")
        where = {"gsplat": "cuda", "HiGS": "experimental/render/kernels/cuda"}[name]
        spec = importlib.util.spec_from_file_location("b", source / "gsplat" / where / "build.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        own = module.get_build_parameters()
        # Without the backward pass, other primitives and picking: bound lazily, never called.
        skip = (r"Bwd|Sparse|Contributing|ToIndices|2DGS|FromWorld|UT3DGS|Priming|TileLidar|Adam|"
                r"ExternalDist|Losses|Relocation|MCMC|3DGSPacked")
        sources = [s for s in own.sources if not (s.endswith(".cu") and re.search(skip, s))]
        include += own.extra_include_paths
        flags, cxx = own.extra_cuda_cflags, own.extra_cflags
        link = own.extra_ldflags + ["-Wl,-z,lazy"]
    sys.setdlopenflags(os.RTLD_LAZY)
    cpp_extension.load(PEERS[name][0], [str(s) for s in sources], extra_cflags=cxx,
                       extra_cuda_cflags=flags, extra_include_paths=include, extra_ldflags=link,
                       build_directory=str(folder))


def covariances(torch, scales, quaternions):
    w, x, y, z = quaternions.unbind(1)
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    m = torch.stack(rows, 1).reshape(-1, 3, 3) * scales[:, None, :]
    sigma = m @ m.transpose(1, 2)
    return sigma[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]].contiguous()


def on_device(torch, gaussians):
    data = torch.from_numpy(gaussians).cuda()
    g = {"means": data[:, :3].contiguous(), "logits": data[:, 51].contiguous(),
         "log_scales": data[:, 52:55].contiguous(),
         "quats": torch.nn.functional.normalize(data[:, 55:59]),
         "sh": torch.cat([data[:, None, 3:6], data[:, 6:51].reshape(-1, 3, 15).mT], 1).contiguous()}
    g["opacity"], g["scales"] = g["logits"].sigmoid(), g["log_scales"].exp()
    g["cov"] = covariances(torch, g["scales"], g["quats"])
    return g


def renderer(name, torch, c, g, camera, peers):
    """A function that renders one frame, and one that makes H x W x 3 floats of its result."""
    width, height, focal = camera["width"], camera["height"], camera["focal"]
    half_x, half_y = width / (2 * focal), height / (2 * focal)
    view = torch.eye(4)
    view[:3, :3], view[:3, 3] = torch.tensor(camera["R"]), torch.tensor(camera["t"])
    view, center = view.cuda(), torch.tensor(camera["center"], dtype=torch.float32).cuda()
    means, black = g["means"], torch.zeros(3, device="cuda")
    chw = lambda image: image.permute(1, 2, 0)
    if name in ("original", "RoofGS"):
        far, near = 100.0, 0.01
        projection = torch.zeros(4, 4)
        projection[0, 0], projection[1, 1], projection[3, 2] = 1 / half_x, 1 / half_y, 1
        projection[2, 2], projection[2, 3] = far / (far - near), -far * near / (far - near)
        columns = view.T.contiguous()
        whole = (columns @ projection.T.cuda()).contiguous()
        none = torch.empty(0, device="cuda")
        tail = (columns, whole, half_x, half_y, height, width)
        if name == "original":
            return lambda: c.rasterize_gaussians(
                black, means, none, g["opacity"][:, None], g["scales"], g["quats"], 1.0, none, *tail,
                g["sh"], 3, center, False, False)[1], chw
        ranges = [(0, 1), (1, 4), (4, 9), (9, 16)]  # 8 bits a coefficient, a scale a degree and color
        factors = torch.cat([torch.quantile(g["sh"][:100000, a:b].abs().reshape(-1, 3)[:10 ** 6],
                                            0.9998, dim=0)[None].expand(b - a, 3) for a, b in ranges])
        quantized = (g["sh"] / (factors / 127)).round().clamp(-127, 127).to(torch.int8)
        scales = (factors[[0, 1, 4, 9]] / 127).flatten().half()
        reach = (means @ view[2, :3] + view[2, 3] + 8 * g["scales"].max(1).values).max().item()
        cov = g["cov"].half()
        return lambda: c.rasterize_gaussians(
            black, means, none, g["opacity"][:, None], none, none, 1.0, cov, *tail, quantized, 3,
            center, False, False, scales, min(max(2 * reach, 35), 115))[1], chw
    if name in ("PolySplat", "FlashGS"):
        sys.modules.setdefault(PEERS[name][0], c)
        sys.path.insert(0, str(peers / name))
        example = importlib.import_module("example")
        scene = example.Scene("cuda")
        scene.num_vertex, scene.position, scene.opacity = len(means), means, g["opacity"]
        scene.shs, scene.cov3d = g["sh"].reshape(-1, 48), g["cov"]
        scene.shs_half = scene.shs.half()
        view = example.Camera({"id": 0, "img_name": "", "width": width, "height": height, "fx": focal,
                               "fy": focal, "position": camera["center"].tolist(),
                               "rotation": camera["R"].T.tolist()})
        rasterizer, dark = example.Rasterizer(scene, 2 ** 27, 2 ** 20), torch.zeros(3)
        more = {}
        if name == "PolySplat":
            more = {"render_variant": "preranges_smem_persistent_lite_e2e"}
        return (lambda: rasterizer.forward(scene, view, dark, **more),
                lambda image: image.view(torch.uint8).float() / 255)
    if name == "Faster-GS":
        first, rest = g["sh"][:, :1].contiguous(), g["sh"][:, 1:].contiguous()
        return lambda: c.inference(
            means, g["log_scales"], g["quats"], g["logits"][:, None], first, rest, view, center, black,
            16, width, height, focal, focal, width / 2, height / 2, 0.2, 1e4, False, False,
            True), lambda image: image
    k = torch.tensor([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1.0]], device="cuda")
    if name == "HiGS":
        packed = torch.cat([g["quats"], g["scales"], g["opacity"][:, None]], 1).half()
        planes, colors = means.T.contiguous(), g["sh"].half()
        native = c.GaussianInferenceRenderer(planes, packed, colors, 3, 0)
        out = torch.empty(1, height, width, 4, device="cuda", dtype=torch.float16)
        return (lambda: native.render(planes, packed, colors, view, k, width, height, 8, 0.2, 1e10, 0.0,
                                      0.3, 3, 0, None, out), lambda image: image[0, ..., :3].float())
    sys.modules.setdefault("gsplat.csrc", c)
    sys.path.insert(0, str(peers / "gsplat"))
    gsplat = importlib.import_module("gsplat")
    return lambda: gsplat.rasterization(
        means, g["quats"], g["scales"], g["opacity"], g["sh"], view[None], k[None], width, height,
        near_plane=0.2, sh_degree=3, packed=False)[0], lambda image: image[0]
