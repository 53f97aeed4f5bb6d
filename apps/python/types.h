// SPDX-License-Identifier: BSD-3-Clause
// The data of the Python classes. Each shares the ownership of its data, so that a view, an array
// or a mask outlives the session that it came from.
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>

#include "calls.h"
#include "colmap_io/workspace.h"
#include "editing/edit_session.h"
#include "recolor/color_edit.h"
#include "scene/gaussian_model.h"

namespace retint::python {

namespace py = pybind11;

struct PyWorkspace {
  std::shared_ptr<const Workspace> data;
};

struct PyView {
  std::shared_ptr<const Workspace> workspace;
  const View* view = nullptr;
};

struct PySplat {
  std::shared_ptr<GaussianModel> data;
  bool writeable = true;  // false: a session's own
};

// A selection in 3D and how it came about.
struct PySelection {
  SelectionSource source;
  std::vector<DepthEstimate> depths;
};

// Masks by image name and the Gaussians' shares.
struct PyMasks {
  std::map<std::string, Mask> masks;
  std::vector<float> shares;
  SelectionSource source;
  std::string warning;
  std::vector<float> confidence, visible;  // as ProjectedMasks has them
};

// A region as it was when it was asked for.
struct PyRegion {
  Region data;
};

class PySession {
 public:
  explicit PySession(std::shared_ptr<EditSession> session)
      : session_(std::move(session)),
        size_(std::to_string(session_->scene().reconstruction().views.size()) + " views, " +
              std::to_string(session_->scene().original().NumGaussians()) + " Gaussians") {}

  // work(session, monitor) without the interpreter's lock, one call at a time. RunError when the
  // session was closed, or is called from its own progress callback.
  template <typename Work>
  auto Use(py::object progress, Work&& work) {
    RequireIdle();
    Call call(std::move(progress));
    return call.Run([&](Monitor& monitor) {
      const std::lock_guard lock(mutex_);
      const User user(user_);
      if (!session_) throw RunError("the session is closed");
      return work(*session_, monitor);
    });
  }
  template <typename Work>
  auto Use(Work&& work) {
    return Use(py::none(), [&](EditSession& session, Monitor&) { return work(session); });
  }
  // With a part of the session as another owner of all of it.
  template <typename Part>
  std::shared_ptr<Part> Share(Part& part) {
    return {session_, &part};
  }
  void Close() {
    RequireIdle();
    std::shared_ptr<EditSession> last;
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    last = std::move(session_);
  }
  bool closed() const { return !session_; }
  // Of the scene, which stays: so it needs no turn.
  std::string Description() const {
    return "<retint.Session " + size_ + (closed() ? ", closed>" : ">");
  }

 private:
  // Of this thread: others wait.
  void RequireIdle() const {
    if (user_ == std::this_thread::get_id()) {
      throw RunError("the session is at work: its progress callback cannot call it");
    }
  }
  struct User {
    explicit User(std::atomic<std::thread::id>& id) : user(id) {
      user = std::this_thread::get_id();
    }
    ~User() { user = std::thread::id(); }
    std::atomic<std::thread::id>& user;
  };

  std::shared_ptr<EditSession> session_;
  const std::string size_;
  std::mutex mutex_;  // held while the session works
  std::atomic<std::thread::id> user_{};
};

// A camera of a workspace's view or of its own, and the view where it is one.
struct Viewpoint {
  PosedCamera camera;
  const View* view = nullptr;
};
// From a View, a Camera or a view's name. InputError for a name that is none.
Viewpoint ToViewpoint(const py::object& view, const Workspace* workspace);

// Of one Painted or a sequence of them. OptionError for other objects.
std::vector<PaintedView> ToPainted(const py::object& painted);

// A region, or its id.
RegionId ToId(const py::object& region);
// The selection of a Region as it was when it was asked for, or of the region of an id as it is.
std::shared_ptr<const RegionSelection> SelectionOf(PySession& self, const py::object& region);

// The three kinds of errors as Python exceptions.
void BindErrors(py::module_& module);
void BindScene(py::module_& module);              // Workspace, View, Camera, Splat, pictures
void BindEdit(py::module_& module);               // Edit
void BindSelection(py::module_& module);          // Depth, Selection, Masks, Region
void BindSession(py::module_& module);            // Session
void BindSelecting(py::class_<PySession>& type);  // Session: paint, select, project
void BindOutlines(py::class_<PySession>& type);   // Session: mask, palette
void BindPhotos(py::class_<PySession>& type);     // Session: photos in their own pixels
void BindRounds(py::class_<PySession>& type);     // Session: rounds, suggestions, background fits
void BindRender(py::module_& module);             // render, depth, orbit, options
void BindJobs(py::module_& module);               // run_job
void BindTools(py::module_& module);              // align, score

}  // namespace retint::python
