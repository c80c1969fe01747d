// The caster's pictures against those of the plain renderer in double precision, of random scenes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "doppel/sensors/render/scene_builder.h"
#include "reference_renderer.h"

namespace doppel {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 61, kHeight = 46;

class RandomWorld {
 public:
  RandomWorld(unsigned seed, bool textured) : random_(seed) {
    SceneBuilder builder;
    if (flip()) builder.environment().sky = Sky{};
    for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot})
      if (flip()) builder.add_light(light(kind));
    for (int i = 0; i < 12; ++i) {
      const int body = builder.add_body("body" + std::to_string(i));
      const Geometry shapes[] = {Box{{size(), size(), size()}}, Cylinder{size() / 2, size()},
                                 Cone{size() / 2, size()}, Sphere{size() / 2}};
      builder.add_shape(body, shapes[random_() % 4], pose(0.2), material());
      poses.push_back(pose(1.2));
    }
    RenderScene made = *builder.finish();
    for (SceneItem& item : made.items)
      if (textured && flip()) add_texture(made, item);
    scene = std::make_shared<const RenderScene>(std::move(made));
    before = poses;
    for (std::size_t i = 0; i < poses.size(); i += 3) poses[i] = pose(1.2);
    view.X_WC = pose(0.3);
    view.X_WC.translation() -= 3.5 * view.X_WC.linear().col(2);
    view.near = uniform(0.01, 3);
    view.far = uniform(4, 8);
    view.own_body = static_cast<int>(random_() % 12);
    view.depth = view.labels = true;
    const bool fisheye = flip();
    const int samples = flip() ? 1 : 3;
    for (int i = 0; i < samples; ++i) lens.push_back(table(fisheye, uniform(-0.5, 0.5), uniform(-0.5, 0.5)));
  }

  std::shared_ptr<const RenderScene> scene;
  std::vector<Pose> before, poses;  // some bodies have moved since
  CameraView view;
  std::vector<PixelRays> lens;

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  bool flip() { return random_() % 2 == 0; }
  double size() { return uniform(0.2, 0.8); }
  Vector3d vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }
  Pose pose(double spread) {
    Pose X = Pose::Identity();
    X.linear() = Eigen::AngleAxisd(uniform(-3, 3), vector().normalized()).toRotationMatrix();
    X.translation() = spread * vector();
    return X;
  }
  Light light(LightKind kind) {
    Light out;
    out.kind = kind;
    out.X_WL = pose(3);
    out.direction_W = vector().normalized();
    out.diffuse << uniform(0, 1), uniform(0, 1), uniform(0, 1), 1;
    out.range = uniform(2, 20);
    out.attenuation_quadratic = uniform(0, 0.3);
    out.inner_angle = uniform(0.2, 0.8);
    out.outer_angle = uniform(1, 2.5);
    out.falloff = uniform(0.5, 2);
    out.intensity = uniform(0.5, 2);
    out.cast_shadows = flip();
    out.on = random_() % 8 != 0;
    return out;
  }
  SurfaceMaterial material() {
    SurfaceMaterial out;
    for (int i = 0; i < 3; ++i) out.rgba[i] = static_cast<float>(uniform(0, 1));
    if (random_() % 3 == 0) out.rgba[3] = static_cast<float>(uniform(0.2, 0.9));
    if (flip()) out.emissive = vector().cwiseAbs().cast<float>() * 0.3F;
    out.specular = flip() ? static_cast<float>(uniform(0, 1)) : 0;
    out.shininess = static_cast<float>(uniform(1, 40));
    return out;
  }
  void add_texture(RenderScene& into, SceneItem& item) {
    Bitmap image{64, 32, flip() ? 3 : 4, {}};
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < image.channels; ++c)
          image.pixels.push_back(static_cast<std::uint8_t>(
              150 + 60 * std::sin(2 * M_PI * (x / 64.0 + c / 3.0)) * std::cos(2 * M_PI * y / 32.0)));
    auto mesh = std::make_shared<SurfaceMesh>(*into.meshes[static_cast<std::size_t>(item.mesh)]);
    const Vector3d u = vector(), v = vector();
    mesh->uvs.clear();
    for (const Eigen::Vector3f& p : mesh->positions)
      mesh->uvs.emplace_back(u.cast<float>().dot(p), v.cast<float>().dot(p));
    SurfaceMaterial material = into.materials[static_cast<std::size_t>(item.material)];
    material.texture = static_cast<int>(into.textures.size());
    into.textures.push_back(std::move(image));
    item.mesh = static_cast<int>(into.meshes.size());
    into.meshes.push_back(std::move(mesh));
    item.material = static_cast<int>(into.materials.size());
    into.materials.push_back(material);
  }
  // A fisheye's picture is a disc, with nothing outside.
  static PixelRays table(bool fisheye, double dx, double dy) {
    PixelRays out;
    out.width = kWidth;
    out.height = kHeight;
    out.planar = !fisheye;
    out.pixel_angle = 1 / 50.0F;
    for (int v = 0; v < out.height; ++v)
      for (int u = 0; u < out.width; ++u) {
        const double x = (u - 30 + dx) / 50, y = (v - 22.5 + dy) / 50, angle = std::hypot(x, y);
        Vector3d d(x, y, 1);
        if (fisheye) d = Vector3d(x / angle * std::sin(angle), y / angle * std::sin(angle), std::cos(angle));
        if (fisheye && angle > 0.55) d.setZero();
        out.x.push_back(static_cast<float>(d.x()));
        out.y.push_back(static_cast<float>(d.y()));
        out.z.push_back(static_cast<float>(d.z()));
      }
    return out;
  }

  std::mt19937 random_;
};

constexpr float kShift = 0.03F / 50;  // of a ray, 0.03 pixels: what edges of things and shadows may differ by

// The reference's pictures with rays as they are, and with all of them shifted to four sides.
std::vector<CameraPicture> references(const RandomWorld& world) {
  ReferenceRenderer renderer(world.scene);
  renderer.set_poses(world.poses);
  std::vector<CameraPicture> out;
  for (const auto& [dx, dy] :
       {std::pair{0.0F, 0.0F}, {kShift, 0.0F}, {-kShift, 0.0F}, {0.0F, kShift}, {0.0F, -kShift}}) {
    std::vector<PixelRays> lens = world.lens;
    for (PixelRays& rays : lens)
      for (std::size_t i = 0; i < rays.x.size(); ++i) {
        if (rays.z[i] == 0) continue;
        rays.x[i] += dx;
        rays.y[i] += dy;
      }
    CameraView view = world.view;
    view.samples = lens;
    renderer.render(view, out.emplace_back());
  }
  return out;
}

bool same_depth(float a, float b) {
  return a == b || std::abs(a - b) <= 2e-5F * std::abs(b) + 1e-5F;
}
bool same_colour(const CameraPicture& a, const CameraPicture& b, std::size_t pixel) {
  for (std::size_t c = 3 * pixel; c < 3 * pixel + 3; ++c)
    if (std::abs(a.rgb[c] - b.rgb[c]) > 2) return false;
  return true;
}
// Between the least and the largest values of the reference, which are different where an edge is near.
bool colour_between(const CameraPicture& picture, const std::vector<CameraPicture>& of, std::size_t pixel,
                    int tolerance) {
  for (std::size_t c = 3 * pixel; c < 3 * pixel + 3; ++c) {
    const auto [low, high] = std::minmax_element(
        of.begin(), of.end(),
        [c](const CameraPicture& a, const CameraPicture& b) { return a.rgb[c] < b.rgb[c]; });
    if (picture.rgb[c] < low->rgb[c] - tolerance || picture.rgb[c] > high->rgb[c] + tolerance) return false;
  }
  return true;
}

// Pixels must be those of the reference for a ray within the shift, and nearly all those of their own ray.
void compare(const CameraPicture& picture, const std::vector<CameraPicture>& of, int tolerance) {
  ASSERT_EQ(picture.labels.size(), of[0].labels.size());
  int labels = 0, depths = 0, colours = 0, outside = 0;
  for (std::size_t i = 0; i < picture.labels.size(); ++i) {
    SCOPED_TRACE(testing::Message() << "pixel " << i % kWidth << ", " << i / kWidth);
    labels += picture.labels[i] != of[0].labels[i] ? 1 : 0;
    depths += same_depth(picture.depth[i], of[0].depth[i]) ? 0 : 1;
    colours += same_colour(picture, of[0], i) ? 0 : 1;
    EXPECT_TRUE(std::any_of(of.begin(), of.end(),
                            [&](const CameraPicture& one) {
                              return picture.labels[i] == one.labels[i] &&
                                     (picture.depth[i] == one.depth[i] ||
                                      std::abs(picture.depth[i] - one.depth[i]) < 1e-3F);
                            }))
        << picture.labels[i] << " at " << picture.depth[i] << " m";
    outside += colour_between(picture, of, i, tolerance) ? 0 : 1;
  }
  EXPECT_LE(labels, 2);
  EXPECT_LE(depths, 2);
  // Where two surfaces nearly touch, single precision may see them in the other order.
  EXPECT_LE(outside, 2);
  EXPECT_LE(colours, 28);  // a hundredth of the pixels
}

// Textures are smooth and of few texels, because the caster chooses one of its halved pictures where the reference takes
// the mean over the pixel; hence their tolerance.
TEST(CameraRenderers, CasterShowsRandomScenesAsReferenceDoes) {
  const unsigned seed = 20261124;
  for (unsigned round = 0; round < 12; ++round) {
    SCOPED_TRACE(testing::Message() << "seed " << seed << " + " << round);
    const bool textured = round % 3 == 0;
    const RandomWorld world(seed + round, textured);
    const std::unique_ptr<RayCaster> caster = make_ray_caster(world.scene);
    caster->set_poses(world.before);
    caster->set_poses(world.poses);
    CameraView view = world.view;
    view.samples = world.lens;
    CameraPicture picture;
    caster->render(view, picture);
    compare(picture, references(world), textured ? 16 : 2);
  }
}

}  // namespace
}  // namespace doppel
