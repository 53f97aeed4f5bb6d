// SPDX-License-Identifier: BSD-3-Clause
#include "scene/transform.h"

#include <cmath>

#include "scene/sh_band4.h"
#include "scene/sh_rotation.h"

namespace retint {

Sim3d Compose(const Sim3d& b_from_a, const Sim3d& a_from_c) {
  return {b_from_a.scale * a_from_c.scale, (b_from_a.rotation * a_from_c.rotation).normalized(),
          b_from_a * a_from_c.translation};
}

void Transform(const Sim3d& new_from_old, Reconstruction& model) {
  for (auto& [id, view] : model.views) {
    Rigid3d& pose = view.cam_from_world;
    pose.rotation = (pose.rotation * new_from_old.rotation.conjugate()).normalized();
    pose.translation =
        new_from_old.scale * pose.translation - pose.rotation * new_from_old.translation;
  }
  for (auto& [id, point] : model.points) point.xyz = new_from_old * point.xyz;
}

void Transform(const Sim3d& new_from_old, GaussianModel& model) {
  const ShRotation turn(new_from_old.rotation);
  const auto grow = static_cast<float>(std::log(new_from_old.scale));
  const size_t block = static_cast<size_t>(model.NumShCoeffs()) * 3;
  ShBand4Columns band4(model);
  for (size_t i = 0; i < model.NumGaussians(); ++i) {
    Eigen::Map<Eigen::Vector3f> mean(model.means.data() + 3 * i);
    mean = (new_from_old * Eigen::Vector3d(mean.cast<double>())).cast<float>();
    // wxyz. A zero quaternion means no rotation.
    float* q = model.quats_wxyz.data() + 4 * i;
    Eigen::Quaterniond own(q[0], q[1], q[2], q[3]);
    if (own.squaredNorm() == 0) own.setIdentity();
    const Eigen::Quaterniond turned = new_from_old.rotation * own;
    q[0] = static_cast<float>(turned.w()), q[1] = static_cast<float>(turned.x());
    q[2] = static_cast<float>(turned.y()), q[3] = static_cast<float>(turned.z());
    for (size_t k = 0; k < 3; ++k) model.log_scales[3 * i + k] += grow;
    turn.Apply(model.sh_degree, model.sh.data() + block * i);
    if (!band4.present()) continue;
    ShBand4 values = band4.Get(i);
    turn.ApplyToBand4(values.data());
    band4.Set(i, values);
  }
}

}  // namespace retint
