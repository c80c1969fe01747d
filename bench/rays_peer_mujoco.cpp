// MuJoCo's renderer and its rays. Its room has walls of boxes, because it draws surfaces from one side only.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <cstring>
#include <numeric>
#include <stdexcept>

#include "rays_peers.h"

namespace doppel {
namespace {

std::string mesh_element(const SurfaceMesh& mesh, const char* name) {
  std::string out = fmt::format("<mesh name=\"{}\" vertex=\"", name);
  for (const Eigen::Vector3f& p : mesh.positions) out += fmt::format("{} {} {} ", p.x(), p.y(), p.z());
  out += "\" normal=\"";
  for (const Eigen::Vector3f& n : mesh.normals) out += fmt::format("{} {} {} ", n.x(), n.y(), n.z());
  out += "\" face=\"";
  for (const auto& t : mesh.triangles) out += fmt::format("{} {} {} ", t[0], t[1], t[2]);
  return out + "\"/>\n";
}

std::string walls() {
  std::string out;
  const Eigen::Vector3d half(5, 5, 2);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      Eigen::Vector3d p(0, 0, 2), size = half;
      p[axis] += side * (half[axis] + 0.05);
      size[axis] = 0.05;
      out += fmt::format("<geom type=\"box\" size=\"{} {} {}\" pos=\"{} {} {}\" rgba=\".3 .8 .9 1\"/>\n",
                         size.x(), size.y(), size.z(), p.x(), p.y(), p.z());
    }
  return out;
}

std::string mjcf_of(const RenderScene& scene) {
  std::string out =
      "<mujoco><compiler boundmass=\"1\" boundinertia=\"1\"/>\n"
      "<visual><map znear=\".005\" zfar=\"5\" shadowscale=\"1\" shadowclip=\"1.2\"/>"
      "<quality shadowsize=\"2048\" offsamples=\"0\"/>"
      "<global offwidth=\"640\" offheight=\"480\"/></visual><statistic extent=\"10\" center=\"0 0 "
      "2\"/>\n<asset>" +
      mesh_element(*scene.meshes[1], "ball") +
      "</asset><worldbody>\n<light directional=\"true\" dir=\".2 .3 -1\" pos=\"0 0 3.9\" "
      "castshadow=\"true\"/>\n" +
      walls();
  for (const SceneItem& item : scene.items) {
    if (item.mesh != 1) continue;
    const Eigen::Vector3d p = item.X_BM.translation();
    const std::string geom = "<geom type=\"mesh\" mesh=\"ball\" rgba=\".5 .8 .6 1\" ";
    if (item.body == 0)
      out += geom + fmt::format("pos=\"{} {} {}\"/>\n", p.x(), p.y(), p.z());
    else
      out += fmt::format("<body mocap=\"true\" pos=\"0 0 {}\">", item.body) + geom + "/></body>\n";
  }
  return out + "</worldbody></mujoco>";
}

mjModel* load(const RenderScene& scene) {
  const std::string xml = mjcf_of(scene);
  auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[0], xml.data(), xml.size());
  char error[1000] = "";
  mjModel* model = mj_loadXML("scene.xml", files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (model == nullptr) throw std::runtime_error(std::string("MuJoCo cannot load the scene: ") + error);
  return model;
}

class Mujoco : public MujocoPeer {
 public:
  explicit Mujoco(const RenderScene& scene) : model_(load(scene)), data_(mj_makeData(model_)) {
    mjv_defaultOption(&option_);
    mjv_defaultCamera(&camera_);
    mjv_defaultScene(&scene_);
    mjv_makeScene(model_, &scene_, 1000);
    mjr_defaultContext(&context_);
    mjr_makeContext(model_, &context_, mjFONTSCALE_100);
    mjr_setBuffer(mjFB_OFFSCREEN, &context_);
    if (context_.currentBuffer != mjFB_OFFSCREEN) throw std::runtime_error("MuJoCo has no offscreen buffer");
  }
  ~Mujoco() override {
    mjr_freeContext(&context_);
    mjv_freeScene(&scene_);
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  Mujoco(const Mujoco&) = delete;
  Mujoco& operator=(const Mujoco&) = delete;

  void picture(const PeerView& view, const std::vector<Pose>& bodies) override {
    gl_.use();
    place(bodies);
    mjv_updateScene(model_, data_, &option_, nullptr, &camera_, mjCAT_ALL, &scene_);
    look(view);
    const auto pixels = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    rgb_.resize(3 * pixels);
    depth_.resize(pixels);
    const mjrRect all{0, 0, view.width, view.height};
    for (int i = 0; i < mjNRNDFLAG; ++i) scene_.flags[i] = 0;
    scene_.flags[mjRND_SHADOW] = view.colour ? 1 : 0;
    mjr_render(all, &scene_, &context_);
    mjr_readPixels(view.colour ? rgb_.data() : nullptr, depth_.data(), all, &context_);
    for (float& z : depth_) z = kNear * kFar / (kFar - z * (kFar - kNear));
    if (!view.colour) return;
    scene_.flags[mjRND_SHADOW] = 0;
    scene_.flags[mjRND_SEGMENT] = scene_.flags[mjRND_IDCOLOR] = 1;
    mjr_render(all, &scene_, &context_);
    mjr_readPixels(rgb_.data(), nullptr, all, &context_);
  }

  [[nodiscard]] double mean_depth() const override {
    return std::accumulate(depth_.begin(), depth_.end(), 0.0) / static_cast<double>(depth_.size());
  }

  void scan(const ScanPattern& pattern, const Pose& X_WS, const std::vector<Pose>& bodies,
            std::vector<double>& distances) override {
    place(bodies);
    distances.clear();
    const Eigen::Vector3d p = X_WS.translation();
    for (const Eigen::Vector3f& d : pattern.directions) {
      const Eigen::Vector3d along = X_WS.linear() * d.cast<double>();
      int geom = -1;
      distances.push_back(mj_ray(model_, data_, p.data(), along.data(), nullptr, 1, -1, &geom));
    }
  }

 private:
  static constexpr float kNear = 0.05F, kFar = 50;

  void place(const std::vector<Pose>& bodies) {
    for (int i = 0; i < model_->nmocap; ++i) {
      const Eigen::Vector3d p = bodies[static_cast<std::size_t>(i) + 1].translation();
      std::copy(p.data(), p.data() + 3, data_->mocap_pos + 3 * i);
    }
    mj_kinematics(model_, data_);
    mj_camlight(model_, data_);
  }
  void look(const PeerView& view) {
    const Pose X = from_corner();
    const CameraIntrinsics lens = intrinsics_of(camera_of(view.width, view.height));
    for (mjvGLCamera& eye : scene_.camera) {
      for (int i = 0; i < 3; ++i) {
        eye.pos[i] = static_cast<float>(X.translation()[i]);
        eye.forward[i] = static_cast<float>(X.linear()(i, 2));
        eye.up[i] = static_cast<float>(-X.linear()(i, 1));
      }
      eye.frustum_center = 0;
      eye.frustum_top = kNear * static_cast<float>(view.height / 2.0 / lens.fy);
      eye.frustum_bottom = -eye.frustum_top;
      eye.frustum_near = kNear;
      eye.frustum_far = kFar;
    }
  }

  GlContext gl_;
  mjModel* model_;
  mjData* data_;
  mjvOption option_{};
  mjvCamera camera_{};
  mjvScene scene_{};
  mjrContext context_{};
  std::vector<unsigned char> rgb_;
  std::vector<float> depth_;
};

}  // namespace

std::unique_ptr<MujocoPeer> make_mujoco_peer(const RenderScene& scene) {
  return std::make_unique<Mujoco>(scene);
}

}  // namespace doppel
