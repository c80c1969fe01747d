// MuJoCo's renderer and its rays. Its room has walls of boxes, because it draws surfaces from one side only.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstring>
#include <limits>
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
      if (axis == 2 && side > 0) continue;  // no roof
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

// OpenGL's rows are from the bottom.
template <class Value>
void turn_rows(std::vector<Value>& values, int height) {
  const auto row = static_cast<std::ptrdiff_t>(values.size()) / height;
  for (std::ptrdiff_t top = 0, bottom = height - 1; top < bottom; ++top, --bottom)
    std::swap_ranges(values.begin() + top * row, values.begin() + (top + 1) * row,
                     values.begin() + bottom * row);
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

  void set_poses(std::span<const Pose> bodies) override {
    for (int i = 0; i < model_->nmocap; ++i) {
      const Eigen::Vector3d p = bodies[static_cast<std::size_t>(i) + 1].translation();
      std::copy(p.data(), p.data() + 3, data_->mocap_pos + 3 * i);
    }
    mj_kinematics(model_, data_);
    mj_camlight(model_, data_);
  }

  void render(const CameraView& view, CameraPicture& out) const override {
    gl_.use();
    mjv_updateScene(model_, data_, &option_, nullptr, &camera_, mjCAT_ALL, &scene_);
    look(view);
    const PixelRays& lens = view.samples.front();
    const auto pixels = static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height);
    out.rgb.resize(view.colour ? 3 * pixels : 0);
    out.depth.resize(view.depth ? pixels : 0);
    out.labels.resize(view.labels ? pixels : 0);
    const mjrRect all{0, 0, lens.width, lens.height};
    for (int i = 0; i < mjNRNDFLAG; ++i) scene_.flags[i] = 0;
    scene_.flags[mjRND_SHADOW] = view.colour ? 1 : 0;
    mjr_render(all, &scene_, &context_);
    mjr_readPixels(view.colour ? out.rgb.data() : nullptr, view.depth ? out.depth.data() : nullptr, all,
                   &context_);
    const auto near = static_cast<float>(view.near), far = static_cast<float>(view.far);
    for (float& z : out.depth)
      z = z < 1 ? near * far / (far - z * (far - near)) : std::numeric_limits<float>::infinity();
    turn_rows(out.rgb, lens.height);
    turn_rows(out.depth, lens.height);
    if (!view.labels) return;
    scene_.flags[mjRND_SHADOW] = 0;
    scene_.flags[mjRND_SEGMENT] = scene_.flags[mjRND_IDCOLOR] = 1;
    mjr_render(all, &scene_, &context_);
    segments_.resize(3 * pixels);
    mjr_readPixels(segments_.data(), nullptr, all, &context_);
    for (std::size_t i = 0; i < pixels; ++i)  // the place of a shape among all that are drawn, from 1
      out.labels[i] = segments_[3 * i] + 256U * segments_[3 * i + 1] + 65536U * segments_[3 * i + 2];
    turn_rows(out.labels, lens.height);
  }

  void scan(const ScanPattern& pattern, const Pose& X_WS, std::vector<double>& distances) const override {
    distances.clear();
    const Eigen::Vector3d p = X_WS.translation();
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const Eigen::Vector3f d = pattern.direction(i);
      const Eigen::Vector3d along = X_WS.linear() * d.cast<double>();
      int geom = -1;
      distances.push_back(mj_ray(model_, data_, p.data(), along.data(), nullptr, 1, -1, &geom));
    }
  }

 private:
  void look(const CameraView& view) const {
    const PinholeLens lens(view);
    const Pose& X = view.X_WC;
    const auto near = static_cast<float>(view.near);
    for (mjvGLCamera& eye : scene_.camera) {
      for (int i = 0; i < 3; ++i) {
        eye.pos[i] = static_cast<float>(X.translation()[i]);
        eye.forward[i] = static_cast<float>(X.linear()(i, 2));
        eye.up[i] = static_cast<float>(-X.linear()(i, 1));
      }
      eye.frustum_center = 0;
      eye.frustum_top = near * static_cast<float>((lens.cy + 0.5) / lens.focal);
      eye.frustum_bottom = near * static_cast<float>((lens.cy + 0.5 - lens.height) / lens.focal);
      eye.frustum_near = near;
      eye.frustum_far = static_cast<float>(view.far);
    }
  }

  GlContext gl_;
  mjModel* model_;
  mjData* data_;
  mjvOption option_{};
  mutable mjvCamera camera_{};
  mutable mjvScene scene_{};
  mjrContext context_{};
  mutable std::vector<unsigned char> segments_;
};

}  // namespace

std::unique_ptr<MujocoPeer> make_mujoco_peer(const RenderScene& scene) {
  return std::make_unique<Mujoco>(scene);
}

}  // namespace doppel
