// SPDX-License-Identifier: BSD-3-Clause
// Session: paint, select, project, edit, refit, evaluate, undo, save.
#include <array>
#include <tuple>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "base/staged_output.h"
#include "colmap_io/nerfstudio.h"
#include "editing/finer_session.h"
#include "editing/match_scene.h"
#include "opening/find_splat.h"
#include "options.h"
#include "rendering.h"
#include "reporting/export.h"
#include "reporting/export_photos.h"
#include "reporting/match_report.h"
#include "results.h"
#include "saving/session_file.h"
#include "splat_io/splat_io.h"
#include "types.h"

namespace retint::python {
namespace {

using Sessions = py::class_<PySession>;

// None, a file, or a matrix [3, 4] or [4, 4].
Sim3d ToSimilarity(const py::object& given) {
  if (given.is_none()) return {};
  if (py::isinstance<py::str>(given) || py::hasattr(given, "__fspath__")) {
    return ReadWorldFromSplat(ToPath(given));
  }
  using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
  const auto matrix = Doubles::ensure(given);  // clears the error where this is no array
  CheckOption(matrix && matrix.ndim() == 2 && (matrix.shape(0) == 3 || matrix.shape(0) == 4) &&
                  matrix.shape(1) == 4,
              "world_from_splat is a file or a matrix [3, 4] or [4, 4]");
  std::string text;
  for (py::ssize_t i = 0; i < matrix.size(); ++i) text += fmt::format("{:.17g} ", matrix.data()[i]);
  return ParseWorldFromSplat(text);
}

SessionOptions MakeOptions(const std::string& backend, int holdout, size_t cache_mb,
                           const std::array<float, 3>& background, const py::object& images,
                           const std::string& model, int views, const py::object& world_from_splat,
                           const py::object& view_folder, const std::string& render_model,
                           const std::string& space, const py::object& ocio) {
  SessionOptions options;
  options.pixels = Pixels::kPinhole;  // arrays are the views', whose cameras Python sees
  options.backend = backend;
  options.holdout = holdout;
  options.cache_bytes = cache_mb << 20;
  options.background = background;
  options.image_folder = ToPath(images);
  options.model = model;
  options.views = views;
  options.world_from_splat = ToSimilarity(world_from_splat);
  options.view_folder = ToPath(view_folder);
  if (!render_model.empty()) {
    options.render_model = ChosenRenderModel(render_model);
    CheckOption(options.render_model.has_value(), "render_model is '', 'default' or 'mip'");
  }
  options.space = {ToPath(ocio).string(), space};
  options.Check();
  return options;
}

std::unique_ptr<PySession> Open(const py::object& workspace, const py::object& splat,
                                const std::string& backend, int holdout, size_t cache_mb,
                                const std::array<float, 3>& background, const py::object& images,
                                const std::string& model, int views,
                                const py::object& world_from_splat, const py::object& view_folder,
                                const std::string& render_model, const std::string& space,
                                const py::object& ocio, py::object progress) {
  const SessionOptions options =
      MakeOptions(backend, holdout, cache_mb, background, images, model, views, world_from_splat,
                  view_folder, render_model, space, ocio);
  const bool read_workspace = !py::isinstance<PyWorkspace>(workspace);
  const bool read_splat = !py::isinstance<PySplat>(splat);
  CheckOption(read_workspace || (options.image_folder.empty() && model.empty()),
              "images and model are of a workspace's folder, not of a Workspace");
  CheckOption(!workspace.is_none() || (read_splat && !splat.is_none()),
              "without a workspace, name the file of the splat");
  CheckOption(world_from_splat.is_none() || (read_workspace && read_splat && !workspace.is_none()),
              "world_from_splat needs the folder of a workspace and the file of a splat");
  CheckOption(view_folder.is_none() || workspace.is_none(),
              "view_folder is of a splat without a workspace");
  const auto folder = read_workspace ? ToPath(workspace) : std::filesystem::path();
  auto file = read_splat ? ToPath(splat) : std::filesystem::path();
  const auto opened = read_workspace ? nullptr : workspace.cast<const PyWorkspace&>().data;
  const auto given = read_splat ? nullptr : splat.cast<const PySplat&>().data;
  Call call(std::move(progress));
  return std::make_unique<PySession>(call.Run([&](Monitor& monitor) {
    const auto root = opened ? opened->root : folder;
    if (read_splat && file.empty()) {
      const auto found = FindSplat(root);
      if (!found) throw InputError(root, "holds no splat; name one");
      file = *found;
    }
    if (read_workspace && read_splat) {
      return std::shared_ptr(EditSession::Open(folder, file, options, monitor));
    }
    Workspace own = opened ? *opened : Workspace::Open(folder, options.image_folder, options.model);
    own.UndistortViews();
    GaussianModel own_splat = given ? *given : ReadSplat(file, monitor);
    own_splat.Validate();
    return std::make_shared<EditSession>(std::move(own), std::move(own_splat), options);
  }));
}

std::unique_ptr<PySession> Load(const py::object& folder, const std::string& backend,
                                size_t cache_mb, py::object progress) {
  const auto path = ToPath(folder);
  SessionOptions options;
  options.pixels = Pixels::kPinhole;  // arrays are the views', whose cameras Python sees
  options.backend = backend;
  options.cache_bytes = cache_mb << 20;
  Call call(std::move(progress));
  return std::make_unique<PySession>(call.Run([&](Monitor& monitor) {
    return std::shared_ptr(OpenSession(path, options, monitor).session);
  }));
}

PyRegion FindRegion(const EditSession& session, RegionId id) {
  const Region* region = session.store().regions().Find(id);
  if (!region) throw OptionError("there is no region " + std::to_string(id));
  return {*region};
}

TargetKind ToTarget(const std::string& name) {
  CheckOption(name == "render" || name == "photo", "target is 'render' or 'photo'");
  return name == "photo" ? TargetKind::kPhoto : TargetKind::kRender;
}

// ---- Regions ----

RegionId AddRegion(PySession& self, const std::string& name, const py::object& masks,
                   const ColorEdit& edit, float strength, py::object progress) {
  PyMasks given = py::isinstance<PyMasks>(masks) ? masks.cast<PyMasks>()
                                                 : py::type::of<PyMasks>()(masks).cast<PyMasks>();
  CheckOption(strength >= 0 && strength <= 1, "strength lies in [0, 1]");
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    const RegionId id = session.store().Add(name, std::move(given.masks), std::move(given.shares),
                                            edit, monitor, std::move(given.source));
    if (strength != 1)
      session.store().Do(SetEdit{id, session.store().regions().Find(id)->edit, strength});
    return id;
  });
}

std::vector<PyRegion> Regions(PySession& self) {
  return self.Use([](EditSession& session) {
    std::vector<PyRegion> regions;
    for (const Region& region : session.store().regions().regions) regions.push_back({region});
    return regions;
  });
}

// A call of the session with a region's id and more.
template <typename Work>
auto OfRegion(Work work) {
  return [work](PySession& self, const py::object& region) {
    const RegionId id = ToId(region);
    return self.Use([&](EditSession& session) { return work(session, id); });
  };
}

py::dict Match(PySession& self, const py::object& like, const std::string& gray,
               const std::string& checker, const std::string& map, py::object progress) {
  const MatchRecipe recipe{map, ToPath(like), gray, checker};
  RegionId id = 0;
  const SceneMatch match =
      self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
        SceneMatch found = MatchByRecipe(session, recipe, monitor);
        id = ApplyMatch(session, found.colors, "match", monitor);
        try {
          session.refits().Refit(session.store().job(), monitor);
        } catch (...) {
          session.store().history().Undo();
          throw;
        }
        return found;
      });
  py::dict dict = FromJson(ToJson(match));
  dict["region"] = id;
  return dict;
}

void BindRegions(Sessions& type) {
  type.def("match", &Match, py::arg("like") = py::none(), py::kw_only(), py::arg("gray") = "",
           py::arg("checker") = "", py::arg("map") = "auto", py::arg("progress") = py::none(),
           "Brings the colors of the scene to its photos', or to those of the splat in the file "
           "`like`, as a region 'match' above the others. `gray`, `checker`: a card as "
           "'VIEW:X,Y,WIDTH,HEIGHT' or with its four corners. `map`: 'auto', 'exposure', "
           "'balance', 'matrix' or 'table'. Returns a dict with the keys of the report of "
           "`retint match` and 'region', the region's id; undo() takes it back.");
  type.def("add_region", &AddRegion, py::arg("name"), py::arg("masks"), py::arg("edit"),
           py::arg("strength") = 1.0F, py::arg("progress") = py::none(),
           "Adds a region above the others and returns its id. `masks`: Masks, or a dict of image "
           "names to masks. `strength`: from 0, no change, to 1, the whole edit. Call refit() to "
           "fit the colors.")
      .def_property_readonly("regions", &Regions,
                             "Every Region, in the order in which their edits apply.")
      .def("region", OfRegion([](EditSession& s, RegionId id) { return FindRegion(s, id); }),
           py::arg("region"), "The region of that id as it is now. OptionError if there is none.")
      .def(
          "set_edit",
          [](PySession& self, const py::object& region, const ColorEdit& edit, float strength) {
            CheckOption(strength >= 0 && strength <= 1, "strength lies in [0, 1]");
            const RegionId id = ToId(region);
            self.Use([&](EditSession& session) {
              session.store().Do(SetEdit{id, edit, strength});
            });
          },
          py::arg("region"), py::arg("edit"), py::arg("strength") = 1.0F,
          "Gives a region another edit and strength, from 0 to 1. Call refit() to fit the colors.")
      .def(
          "set_visible",
          [](PySession& self, const py::object& region, bool visible) {
            const RegionId id = ToId(region);
            self.Use([&](EditSession& session) { session.store().Do(SetVisible{id, visible}); });
          },
          py::arg("region"), py::arg("visible"),
          "Shows a region, or leaves it out of renders, fits and files.")
      .def(
          "rename",
          [](PySession& self, const py::object& region, const std::string& name) {
            const RegionId id = ToId(region);
            self.Use([&](EditSession& session) { session.store().Do(RenameRegion{id, name}); });
          },
          py::arg("region"), py::arg("name"), "Gives a region another name.")
      .def(
          "move_region",
          [](PySession& self, const py::object& region, size_t position) {
            const RegionId id = ToId(region);
            self.Use([&](EditSession& session) { session.store().Do(MoveRegion{id, position}); });
          },
          py::arg("region"), py::arg("position"),
          "Moves a region in the order of edits; position 0 applies first.")
      .def("duplicate",
           OfRegion([](EditSession& s, RegionId id) { return s.store().Duplicate(id); }),
           py::arg("region"), "Copies a region and returns the id of the copy.")
      .def("remove", OfRegion([](EditSession& s, RegionId id) { s.store().Do(RemoveRegion{id}); }),
           py::arg("region"), "Removes a region; undo() brings it back.")
      .def(
          "undo",
          [](PySession& self) {
            return self.Use([](EditSession& s) { return s.store().history().Undo(); });
          },
          "Takes the last change back; False if there is none.")
      .def(
          "redo",
          [](PySession& self) {
            return self.Use([](EditSession& s) { return s.store().history().Redo(); });
          },
          "Repeats the change that undo() took back last; False if there is none.")
      .def_property_readonly(
          "history",
          [](PySession& self) {
            return self.Use([](EditSession& s) {
              auto labels = s.store().history().Labels();
              labels.resize(s.store().history().steps_done());
              return labels;
            });
          },
          "Names of the changes, oldest first.");
}

// ---- Refit and results ----

py::dict Refit(PySession& self, py::object progress, const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.refit.Describe(list); });
  return FromRefit(self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    session.refits().Refit(options.refit, monitor);
    return session.refits().Summary();
  }));
}

py::tuple RefineGaussians(PySession& self, const py::object& region, const py::object& splat,
                          py::object progress, const py::kwargs& keywords) {
  RefineOptions options;
  SetOptions(Described(options), keywords);
  const RegionId id = ToId(region);
  const auto file = ToPath(splat);
  FinerSession finer = self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    if (!file.empty()) CheckOutput(file);
    return MakeFinerSession(session, id, options, file, monitor);
  });
  const RefineSummary& summary = finer.summary;
  py::dict figures;
  figures["split"] = summary.split;
  figures["parts"] = summary.parts;
  figures["part_pixels"] = summary.pixels;
  figures["psnr_split"] = summary.psnr_split;
  figures["psnr"] = summary.psnr;
  figures["warning"] = summary.Warning(options);
  if (!finer.session) return py::make_tuple(py::none(), figures);
  return py::make_tuple(
      std::make_unique<PySession>(std::shared_ptr<EditSession>(std::move(finer.session))), figures);
}

py::dict Evaluate(PySession& self, const py::object& region, const py::object& sh,
                  const std::string& target, size_t most_views, py::object progress) {
  const RegionId id = ToId(region);
  const TargetKind kind = ToTarget(target);
  const Floats after = ToSh(self, sh);
  return FromQuality(self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    if (after.ndim() == 0) return EvaluateRegion(session, id, kind, monitor, most_views);
    return session.refits().Evaluate(id, session.scene().original().sh, SpanOf(after), kind,
                                     monitor, most_views);
  }));
}

py::array CurrentSh(PySession& self) {
  const auto [sh, count, coeffs] = self.Use([](EditSession& session) {
    return std::tuple(session.refits().CurrentSh(), session.scene().original().NumGaussians(),
                      session.scene().original().NumShCoeffs());
  });
  return Owned(sh, {static_cast<py::ssize_t>(count), coeffs, 3});
}

PySplat CurrentSplat(PySession& self) {
  return self.Use([](EditSession& session) {
    auto model = std::make_shared<GaussianModel>(session.scene().original());
    model->sh = session.refits().CurrentSh();
    return PySplat{std::move(model)};
  });
}

PySplat Original(PySession& self) {
  const auto shared = self.Use([&](EditSession& session) {
    return self.Share(
        const_cast<GaussianModel&>(session.scene().original()));  // shown, not written to
  });
  return {shared, /*writeable=*/false};
}

void BindResults(Sessions& type) {
  static const std::string refit_doc = [] {
    RefitJob job;
    return "Fits the colors of every visible region whose fit is out of date. Returns a dict: "
           "'solver', 'iterations', 'active_gaussians', 'changed_gaussians', 'converged', "
           "'losses' and 'reason'." +
           OptionLines(Described(job));
  }();
  static const std::string refine_doc = [] {
    RefineOptions options;
    return "Splits large Gaussians inside a region, so that a picture painted elsewhere shows its "
           "detail. If the edit has such pictures, only Gaussians that they change are split.\n"
           "\n"
           "Returns a pair. First another Session with all regions, not fitted yet, or None if no "
           "Gaussian was split. Then a dict: 'split' Gaussians became 'parts' of 'part_pixels'. "
           "'psnr' (dB) compares the views inside with the original splat; 'psnr_split' did so "
           "before the colors of the parts were fitted. 'warning' is '' if every option was met.\n"
           "\n"
           "`splat`: a file for the finer splat; without it, the new Session cannot be saved." +
           OptionLines(Described(options));
  }();
  type.def("refit", &Refit, py::kw_only(), py::arg("progress") = py::none(), refit_doc.c_str())
      .def("refine_gaussians", &RefineGaussians, py::arg("region"), py::kw_only(),
           py::arg("splat") = py::none(), py::arg("progress") = py::none(), refine_doc.c_str())
      .def("evaluate", &Evaluate, py::arg("region"), py::arg("sh") = py::none(), py::kw_only(),
           py::arg("target") = "render", py::arg("most_views") = 0,
           py::arg("progress") = py::none(),
           "Measures a region's edit. Returns a dict: 'train' and 'heldout' hold 'views', "
           "'psnr_inside_before', 'psnr_inside_after', 'psnr_outside' (dB), 'bleed' and "
           "'out_of_gamut' (in [0, 1]), or are None; 'views' lists every view, the worst first.\n"
           "\n"
           "`sh` [N, K, 3]: coefficients to measure instead of the fitted ones. `target`: "
           "'render' or 'photo', the picture whose edited version counts as right. `most_views`: "
           "measures at most so many views, 0 all.")
      .def_property_readonly("sh", &CurrentSh,
                             "[N, K, 3] float32: a copy of the coefficients with all edits.")
      .def("splat", &CurrentSplat, "A new Splat with all edits.")
      .def_property_readonly(
          "original", &Original,
          "The Splat that the session opened. Its arrays share the session's memory; you cannot "
          "write to them.")
      .def(
          "write_splat",
          [](PySession& self, const py::object& path, py::object progress) {
            const auto file = ToPath(path);
            self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
              session.WriteSplat(file, monitor);
            });
          },
          py::arg("path"), py::arg("progress") = py::none(),
          "Writes the splat with all edits, in the format of the file's extension. OptionError "
          "for an unknown extension, RunError if the file cannot be written.")
      .def(
          "write_cameras",
          [](PySession& self, const py::object& folder, bool images, bool overwrite,
             py::object progress) {
            const auto path = ToPath(folder);
            self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
              ExportCameras(session, images, path, monitor, CheckCamerasFolder(path, overwrite));
            });
          },
          py::arg("folder"), py::kw_only(), py::arg("images") = true, py::arg("overwrite") = false,
          py::arg("progress") = py::none(),
          "Writes the session's views as a COLMAP workspace, as `retint cameras` does, also "
          "those that Retint placed around a splat. `images`: with renders of the original "
          "scene. OptionError if the folder holds a model or pictures; `overwrite` replaces "
          "those that `retint cameras` or this call wrote.")
      .def(
          "write_masks",
          [](PySession& self, const py::object& folder, const py::object& region,
             py::object progress, const std::string& mask_names) {
            const auto path = ToPath(folder);
            const RegionId id = ToId(region);
            const MaskNames names = MaskNamesOf(mask_names);
            self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
              session.WriteMasks(path, id, monitor, names);
            });
          },
          py::arg("folder"), py::arg("region"), py::arg("progress") = py::none(), py::kw_only(),
          py::arg("mask_names") = "colmap",
          "Writes a region's masks. `mask_names`: colmap (`0001.jpg.png`), stem (`0001.png`), "
          "mask (`0001.mask.png`) or metashape (`0001_mask.png`).")
      .def(
          "write_photos",
          [](PySession& self, const py::object& folder, const std::string& mask_names,
             py::object progress) {
            const auto path = ToPath(folder);
            const MaskNames names = MaskNamesOf(mask_names);
            PhotoExport result;
            self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
              CheckOutput(path, /*as_folder=*/true);
              StagedOutput staged;
              result = StagePhotos(staged, session, path, names, {}, monitor);
              staged.Commit();
            });
            py::dict dict;
            dict["edited"] = result.edited;
            dict["unchanged"] = result.unchanged;
            dict["warnings"] = result.warnings;
            return dict;
          },
          py::arg("folder"), py::kw_only(), py::arg("mask_names") = "colmap",
          py::arg("progress") = py::none(),
          "Writes the photos with all visible regions' edits into `FOLDER/images`, with their "
          "metadata and JPEG quality, and masks into `FOLDER/masks`. Photos without a change "
          "are hard links. Returns a dict: `edited` and `unchanged` count photos, `warnings`.")
      .def(
          "report",
          [](PySession& self, const std::string& target, py::object progress) {
            const TargetKind kind = ToTarget(target);
            return FromJson(
                self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
                  return ToJson(FullReport(session, kind, monitor));
                }));
          },
          py::arg("target") = "render", py::arg("progress") = py::none(),
          "Measures every visible region. Returns a dict with the keys of report.json "
          "(docs/files-report.md).")
      .def(
          "save",
          [](PySession& self, const py::object& folder, py::object progress) {
            const auto path = ToPath(folder);
            self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
              SessionWriter(path).Write(TakeSnapshot(session), monitor);
            });
          },
          py::arg("folder"), py::arg("progress") = py::none(),
          "Saves the session as a folder NAME.retint, which load() and the editor open. "
          "InputError if the session was not opened from files.");
}

}  // namespace

RegionId ToId(const py::object& region) {
  if (py::isinstance<PyRegion>(region)) return region.cast<const PyRegion&>().data.id;
  if (PyIndex_Check(region.ptr()) != 0) return region.cast<RegionId>();
  throw OptionError("a region is a Region or its id");
}

std::shared_ptr<const RegionSelection> SelectionOf(PySession& self, const py::object& region) {
  if (py::isinstance<PyRegion>(region)) return region.cast<const PyRegion&>().data.selection;
  const RegionId id = ToId(region);
  return self.Use([&](EditSession& session) { return FindRegion(session, id).data.selection; });
}

Floats ToSh(PySession& self, const py::object& sh) {
  if (sh.is_none()) return Floats(std::vector<py::ssize_t>{});  // of no dimension: none given
  const auto values = Floats::ensure(sh);  // clears the error where this is no array
  CheckOption(bool(values), "sh is an array [N, K, 3] of floats");
  const auto [count, coeffs] = self.Use([](EditSession& session) {
    return std::pair(session.scene().original().NumGaussians(),
                     session.scene().original().NumShCoeffs());
  });
  RequireShape(values, {static_cast<py::ssize_t>(count), coeffs, 3}, "sh");
  return values;
}

void BindSession(py::module_& module) {
  Sessions type(
      module, "Session",
      "A workspace and a splat with regions to recolor. One call at a time works on a "
      "session; calls from other threads wait.\n"
      "\n"
      "Every long call accepts `progress`, a callable of the stage's name and a fraction in "
      "[0, 1]. If it raises an exception, or you press Ctrl-C, the work stops and the "
      "session stays unchanged.");
  type.def(
          py::init(&Open), py::arg("workspace"), py::arg("splat") = py::none(), py::kw_only(),
          py::arg("backend") = "auto", py::arg("holdout") = 0, py::arg("cache_mb") = 640,
          py::arg("background") = std::array<float, 3>{0, 0, 0}, py::arg("images") = py::none(),
          py::arg("model") = "", py::arg("views") = 40, py::arg("world_from_splat") = py::none(),
          py::arg("view_folder") = py::none(), py::arg("render_model") = "", py::arg("space") = "",
          py::arg("ocio") = py::none(), py::arg("progress") = py::none(),
          "Opens a scene. InputError if a file is missing, damaged or does not fit the others.\n"
          "\n"
          "- `workspace`: a folder or a Workspace; None for a splat without one\n"
          "- `splat`: a file or a Splat; None for the one that Retint finds in the workspace\n"
          "- `backend`: 'auto', 'cpu' or 'cuda'\n"
          "- `holdout`: keeps every n-th view by name out of the fit; 0 keeps none out\n"
          "- `cache_mb`: memory for the geometry of views, MiB\n"
          "- `background`: RGB in [0, 1]\n"
          "- `images`: the folder of the photos\n"
          "- `model`: the sparse model's folder inside the workspace\n"
          "- `views`: how many views Retint places around a splat without a workspace\n"
          "- `world_from_splat`: the splat's place in the workspace's world, a JSON file or a "
          "matrix [4, 4] that rotates, scales and moves\n"
          "- `view_folder`: for a splat without a workspace, the COLMAP model with its views, as "
          "`retint cameras` writes it\n"
          "- `render_model`: 'mip' for a splat that was trained with an antialiasing filter, "
          "'default' for one without; '' for the one that its files say\n"
          "- `space`: the color space of the splat's colors, by its name in an OpenColorIO config; "
          "'' for the one that its file says\n"
          "- `ocio`: that config, a file or a built-in one such as 'ocio://default'; None for "
          "that of the environment variable OCIO")
      .def_static("load", &Load, py::arg("folder"), py::kw_only(), py::arg("backend") = "auto",
                  py::arg("cache_mb") = 640, py::arg("progress") = py::none(),
                  "Opens a session that save() or the editor wrote. InputError if it is missing or "
                  "damaged.")
      .def("close", &PySession::Close,
           "Frees the session's memory once no array uses it any more. Later calls raise RunError.")
      .def_property_readonly("closed", &PySession::closed, "True after close().")
      .def("__repr__", &PySession::Description)
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](PySession& self, const py::args&) { self.Close(); })
      .def_property_readonly(
          "workspace",
          [](PySession& self) {
            return PyWorkspace{self.Use(
                [&](EditSession& session) { return self.Share(session.scene().workspace()); })};
          },
          "The Workspace; its cameras are pinhole cameras.")
      .def_property_readonly(
          "backend",
          [](PySession& self) {
            return self.Use([](EditSession& session) {
              return std::string(session.scene().renderer().backend().Name());
            });
          },
          "'cpu' or 'cuda'.")
      .def_property_readonly(
          "warnings",
          [](PySession& self) { return self.Use([](EditSession& s) { return s.warnings(); }); },
          "Problems of the workspace, and parts of a saved session that could not be read and "
          "are computed again.");
  BindSelecting(type);
  BindOutlines(type);
  BindRegions(type);
  BindResults(type);
  BindPhotos(type);
  BindRounds(type);
  BindRendering(type);
}

}  // namespace retint::python
