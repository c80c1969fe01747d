#pragma once
// Other renderers of the benchmark's scene, on Mesa's llvmpipe: a context without a window by EGL.
#include <memory>
#include <vector>

#include "rays_scene.h"

namespace doppel {

// The lens of a table of rays. Throws std::runtime_error: it is not that of a pinhole camera with square pixels, which is
// all that these peers can draw.
struct PinholeLens {
  int width, height;
  double focal, cx, cy;  // pixels; integers are the centres of pixels

  explicit PinholeLens(const CameraView& view);
};

// A context of desktop OpenGL, so that no peer depends on the state that another leaves. Throws std::runtime_error.
class GlContext {
 public:
  GlContext();
  void use() const;

 private:
  void *display_, *context_;
};

// Without textures, highlights and transparency, and with the sun's shadows only; one thread. Surfaces nearer than near
// are left out.
std::unique_ptr<CameraRenderer> make_gl_peer(std::shared_ptr<const RenderScene> scene);

// Only of the benchmark's scene; its light and the numbers of its labels are MuJoCo's own.
class MujocoPeer : public CameraRenderer {
 public:
  // Distances of a scan; negative: nothing.
  virtual void scan(const ScanPattern& pattern, const Pose& X_WS, std::vector<double>& distances) const = 0;
};
std::unique_ptr<MujocoPeer> make_mujoco_peer(const RenderScene& scene);

}  // namespace doppel
