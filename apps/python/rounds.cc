// SPDX-License-Identifier: BSD-3-Clause
// Session: rounds of painting, the next view to paint, and fits on a thread of their own.
#include <chrono>
#include <thread>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "arrays.h"
#include "options.h"
#include "results.h"
#include "selection/suggestion.h"
#include "types.h"

namespace retint::python {
namespace {

using State = BackgroundOptimizer::State;

constexpr auto kBetweenLooks = std::chrono::milliseconds(20);

// ---- Rounds ----

PyMasks SelectRound(PySession& self, const std::string& view, const py::object& mask,
                    const py::object& region, const py::object& before, py::object progress,
                    const py::kwargs& keywords) {
  const EditOptions options = Resolve(keywords, [](EditOptions& o, OptionList& list) {
    o.select.Describe(list);
    o.projector.Describe(list);
  });
  PaintRound round;
  round.view.name = view;
  round.view.camera = self.Use([&](EditSession& session) {
    return session.scene().reconstruction().Posed(session.scene().workspace().RequireView(view));
  });
  const Camera& camera = round.view.camera.camera;
  round.view.mask = ToMask(mask, camera.width, camera.height);
  if (!before.is_none()) round.before = ToMask(before, camera.width, camera.height);
  std::shared_ptr<const RegionSelection> base;
  if (!region.is_none()) base = SelectionOf(self, region);
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    RegionSelection made = session.selection().SelectRound(
        base.get(), std::move(round), options.select, options.projector, monitor);
    PyMasks masks;
    masks.masks = std::move(made.masks);
    masks.shares = std::move(made.shares);
    masks.source = std::move(made.source);
    return masks;
  });
}

void SetSelection(PySession& self, const py::object& region, const PyMasks& masks,
                  py::object progress) {
  const RegionId id = ToId(region);
  self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    if (!session.store().regions().Find(id)) {
      throw OptionError("there is no region " + std::to_string(id));
    }
    session.store().SetSelection(id, masks.masks, masks.shares, monitor, masks.source);
  });
}

py::list Suggest(PySession& self, const PyMasks& masks, int count, py::object progress) {
  CheckOption(count >= 1, "count is at least 1");
  CheckOption(!masks.confidence.empty(),
              "a suggestion follows from the completion: the masks are those of project() with "
              "completion 'near' or 'all'");
  std::vector<std::string> painted;
  for (const PaintedView& view : masks.source.painted) painted.push_back(view.name);
  const auto suggestions = self.Use(std::move(progress), [&](EditSession& session,
                                                             Monitor& monitor) {
    const Pictures pinhole(session.scene().workspace(), Pixels::kPinhole);
    return SuggestViews(session.scene().renderer(), session.scene().reconstruction(),
                        pinhole.Groups(), painted, masks.confidence, masks.visible, count, monitor);
  });
  py::list list;
  for (const ViewSuggestion& one : suggestions) {
    py::dict dict;
    dict["view"] = one.view;
    dict["settles"] = one.settles;
    dict["fraction"] = one.fraction;
    list.append(dict);
  }
  return list;
}

// ---- Fits in the background ----

const char* NameOf(State state) {
  switch (state) {
    case State::kIdle:
      return "idle";
    case State::kRunning:
      return "running";
    case State::kPaused:
      return "paused";
    case State::kFinished:
      return "finished";
    case State::kCancelled:
      return "cancelled";
    case State::kFailed:
      break;
  }
  return "failed";
}

uint64_t StartRefit(PySession& self, py::object progress, const py::kwargs& keywords) {
  const EditOptions options =
      Resolve(keywords, [](EditOptions& o, OptionList& list) { o.refit.Describe(list); });
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    return session.refits().Start(options.refit, monitor);
  });
}

py::object RefitSnapshot(PySession& self) {
  const auto newest =
      self.Use([](EditSession& session) { return session.refits().NewestSnapshot(); });
  if (!newest) return py::none();
  const auto shape = self.Use([](EditSession& session) {
    return std::pair(session.scene().original().NumGaussians(),
                     session.scene().original().NumShCoeffs());
  });
  py::dict dict;
  dict["job"] = newest->job;
  dict["steps"] = newest->steps;
  dict["finished"] = newest->finished;
  dict["losses"] = newest->losses;
  dict["sh"] = ViewOf(newest->sh->data(), {py::ssize_t(shape.first), shape.second, 3}, {},
                      Keeper(newest->sh));
  return dict;
}

std::string WaitRefit(PySession& self, py::object progress) {
  return self.Use(std::move(progress), [&](EditSession& session, Monitor& monitor) {
    while (session.refits().optimizer().state() == State::kRunning) {
      const auto newest = session.refits().NewestSnapshot();
      const double steps = newest ? newest->steps : 0;
      monitor.Step("refit", steps, steps + 1);  // nobody knows how many are to come
      std::this_thread::sleep_for(kBetweenLooks);
    }
    if (session.refits().optimizer().state() == State::kFinished) monitor.Step("refit", 1, 1);
    session.refits().CollectFits();
    if (session.refits().optimizer().state() == State::kFailed)
      throw RunError(session.refits().optimizer().error());
    return std::string(NameOf(session.refits().optimizer().state()));
  });
}

template <typename Work>
auto OnOptimizer(Work work) {
  return [work](PySession& self) {
    self.Use([&](EditSession& session) { work(session.refits().optimizer()); });
  };
}

void BindBackground(py::class_<PySession>& type) {
  type.def("start_refit", &StartRefit, py::kw_only(), py::arg("progress") = py::none(),
           "Starts refit() on a thread and returns at once with the number of the job. It ends "
           "the job before it. wait_refit() takes the result over. Options: those of refit().")
      .def_property_readonly(
          "refit_state",
          [](PySession& self) {
            return std::string(
                NameOf(self.Use([](EditSession& s) { return s.refits().optimizer().state(); })));
          },
          "State of the background fit: 'idle', 'running', 'paused', 'finished', 'cancelled' or "
          "'failed'.")
      .def_property_readonly(
          "refit_snapshot", &RefitSnapshot,
          "The newest state of the background fit, or None: a dict of 'job', 'steps', "
          "'finished', 'losses' and 'sh' [N, K, 3] float32, which you cannot write to.")
      .def("pause_refit", OnOptimizer([](BackgroundOptimizer& o) { o.Pause(); }),
           "Pauses the background fit after its current step.")
      .def("resume_refit", OnOptimizer([](BackgroundOptimizer& o) { o.Resume(); }),
           "Continues after pause_refit().")
      .def("cancel_refit", OnOptimizer([](BackgroundOptimizer& o) { o.Cancel(); }),
           "Ends the background fit. Regions that are done keep their results.")
      .def("wait_refit", &WaitRefit, py::arg("progress") = py::none(),
           "Waits until the background fit ends, takes its results over, and returns its state. "
           "Returns at once if the fit is paused. RunError if it failed.");
}

}  // namespace

void BindRounds(py::class_<PySession>& type) {
  type.def("select_round", &SelectRound, py::arg("view"), py::arg("mask"),
           py::arg("region") = py::none(), py::arg("before") = py::none(), py::kw_only(),
           py::arg("progress") = py::none(),
           "Makes Masks after one more round of painting. `mask`: the whole selection as that "
           "view should show it. `before`: the selection that the view showed before you painted; "
           "None if it showed nothing. `region`: a Region or its id to continue from; None for a "
           "first round. Pixels that you add or remove also change the rounds before. Options: "
           "those of select() and project(). InputError if nothing is left selected.")
      .def("set_selection", &SetSelection, py::arg("region"), py::arg("masks"),
           py::arg("progress") = py::none(), "Gives a region other masks. undo() takes it back.")
      .def("suggest", &Suggest, py::arg("masks"), py::arg("count") = 5,
           py::arg("progress") = py::none(),
           "Suggests the views to paint next, best first: those that show most of the Gaussians "
           "that the Masks of project() are unsure of. Returns dicts of 'view', 'settles' and "
           "'fraction' (of all uncertain pixels, in [0, 1]). Each of the first `count` assumes "
           "that you painted those before it. OptionError if the Masks come without a completion.");
  BindBackground(type);
}

}  // namespace retint::python
