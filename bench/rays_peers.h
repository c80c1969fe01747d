#pragma once
// Other renderers of the benchmark's scene, on Mesa's llvmpipe: a context without a window by EGL.
#include <memory>
#include <string>
#include <vector>

#include "rays_scene.h"

namespace doppel {

// What a peer shall make of one frame.
struct PeerView {
  int width = 0, height = 0;
  bool colour = false;  // with shadows, depths and ids; else depths only
};

class RayPeer {
 public:
  virtual ~RayPeer() = default;
  // Throws std::runtime_error.
  virtual void picture(const PeerView& view, const std::vector<Pose>& bodies) = 0;
  // The mean depth of the last picture, m, to show that the peer has drawn the same.
  [[nodiscard]] virtual double mean_depth() const = 0;
};

// A context of desktop OpenGL, so that no peer depends on the state that another leaves. Throws std::runtime_error.
class GlContext {
 public:
  GlContext();
  void use() const;

 private:
  void *display_, *context_;
};

std::unique_ptr<RayPeer> make_gl_peer(const RenderScene& scene);

class MujocoPeer : public RayPeer {
 public:
  // Distances of a scan; negative: nothing.
  virtual void scan(const ScanPattern& pattern, const Pose& X_WS, const std::vector<Pose>& bodies,
                    std::vector<double>& distances) = 0;
};
std::unique_ptr<MujocoPeer> make_mujoco_peer(const RenderScene& scene);

}  // namespace doppel
