// A plain renderer with OpenGL 3.3: a pass for the shadow map, a pass for colour, ids and depth, and their read-back.
#include <EGL/egl.h>
#include <EGL/eglext.h>
#define GL_GLEXT_PROTOTYPES
#include <GL/glcorearb.h>

#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

#include "rays_peers.h"

namespace doppel {
namespace {

using Eigen::Matrix4f;

constexpr int kShadowSize = 2048;

constexpr const char* kDepthVertex = R"(#version 330 core
layout(location = 0) in vec3 p;
uniform mat4 to_clip, to_world;
void main() { gl_Position = to_clip * (to_world * vec4(p, 1)); })";
constexpr const char* kDepthFragment = "#version 330 core\nvoid main() {}";
constexpr const char* kColourVertex = R"(#version 330 core
layout(location = 0) in vec3 p;
layout(location = 1) in vec3 n;
uniform mat4 to_clip, to_world, to_light;
out vec3 normal;
out vec4 in_light;
void main() {
  vec4 world = to_world * vec4(p, 1);
  normal = mat3(to_world) * n;
  in_light = to_light * world;
  gl_Position = to_clip * world;
})";
constexpr const char* kColourFragment = R"(#version 330 core
in vec3 normal;
in vec4 in_light;
uniform vec3 colour, towards_light;
uniform uint label;
uniform sampler2DShadow shadows;
layout(location = 0) out vec4 out_colour;
layout(location = 1) out uint out_label;
void main() {
  vec3 n = normalize(gl_FrontFacing ? normal : -normal);
  float lit = texture(shadows, in_light.xyz * 0.5 + 0.5 - vec3(0, 0, 0.002));
  vec3 light = colour * (0.13 + lit * max(0.0, dot(n, towards_light)));
  out_colour = vec4(pow(light, vec3(1 / 2.2)), 1);
  out_label = label;
})";

GLuint shader(GLenum kind, const char* source) {
  const GLuint out = glCreateShader(kind);
  glShaderSource(out, 1, &source, nullptr);
  glCompileShader(out);
  GLint good = 0;
  glGetShaderiv(out, GL_COMPILE_STATUS, &good);
  if (good == 0) throw std::runtime_error("OpenGL cannot compile a shader");
  return out;
}

GLuint program(const char* vertex, const char* fragment) {
  const GLuint out = glCreateProgram();
  glAttachShader(out, shader(GL_VERTEX_SHADER, vertex));
  glAttachShader(out, shader(GL_FRAGMENT_SHADER, fragment));
  glLinkProgram(out);
  GLint good = 0;
  glGetProgramiv(out, GL_LINK_STATUS, &good);
  if (good == 0) throw std::runtime_error("OpenGL cannot link a program");
  return out;
}

GLuint texture(GLint format, GLenum kind, GLenum type, int width, int height) {
  GLuint out = 0;
  glGenTextures(1, &out);
  glBindTexture(GL_TEXTURE_2D, out);
  glTexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, kind, type, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return out;
}

struct Mesh {
  GLuint array = 0;
  GLsizei corners = 0;
};

Mesh upload(const SurfaceMesh& mesh) {
  Mesh out;
  glGenVertexArrays(1, &out.array);
  glBindVertexArray(out.array);
  GLuint buffers[3];
  glGenBuffers(3, buffers);
  GLuint slot = 0;
  for (const auto* values : {&mesh.positions, &mesh.normals}) {
    glBindBuffer(GL_ARRAY_BUFFER, buffers[slot]);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(values->size() * 12), values->data(),
                 GL_STATIC_DRAW);
    glEnableVertexAttribArray(slot);
    glVertexAttribPointer(slot++, 3, GL_FLOAT, GL_FALSE, 12, nullptr);
  }
  out.corners = static_cast<GLsizei>(3 * mesh.triangles.size());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[2]);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.triangles.size() * 12),
               mesh.triangles.data(), GL_STATIC_DRAW);
  return out;
}

// World to clip space. The picture is drawn upside down, because rows are read from the bottom.
Matrix4f camera_matrix(const CameraView& view) {
  const PinholeLens lens(view);
  const auto near = static_cast<float>(view.near), far = static_cast<float>(view.far);
  Matrix4f clip = Matrix4f::Zero();
  clip(0, 0) = static_cast<float>(2 * lens.focal / lens.width);
  clip(0, 2) = static_cast<float>((2 * lens.cx + 1) / lens.width - 1);
  clip(1, 1) = static_cast<float>(2 * lens.focal / lens.height);
  clip(1, 2) = static_cast<float>((2 * lens.cy + 1) / lens.height - 1);
  clip(2, 2) = (far + near) / (far - near);
  clip(2, 3) = -2 * far * near / (far - near);
  clip(3, 2) = 1;
  return clip * view.X_WC.inverse().matrix().cast<float>();
}

// World to clip space of a sun whose map covers the room.
Matrix4f light_matrix(const Eigen::Vector3f& direction) {
  const Eigen::Vector3f z = direction.normalized(), x = z.cross(Eigen::Vector3f::UnitY()).normalized(),
                        y = z.cross(x);
  Matrix4f out = Matrix4f::Identity();
  out.row(0).head<3>() = x / 8;
  out.row(1).head<3>() = y / 8;
  out.row(2).head<3>() = z / 8;
  out.topRightCorner<3, 1>() = -out.topLeftCorner<3, 3>() * Eigen::Vector3f(0, 0, 2);
  return out;
}

class Gl : public CameraRenderer {
 public:
  explicit Gl(std::shared_ptr<const RenderScene> scene)
      : scene_(std::move(scene)),
        depth_program_(program(kDepthVertex, kDepthFragment)),
        colour_program_(program(kColourVertex, kColourFragment)) {
    for (const auto& mesh : scene_->meshes) meshes_.push_back(upload(*mesh));
    shadow_map_ =
        texture(GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, kShadowSize, kShadowSize);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glGenFramebuffers(1, &shadow_frame_);
    glBindFramebuffer(GL_FRAMEBUFFER, shadow_frame_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadow_map_, 0);
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    glEnable(GL_DEPTH_TEST);
    glFrontFace(GL_CW);  // in pictures that are upside down
  }

  void set_poses(std::span<const Pose> bodies) override { poses_.assign(bodies.begin(), bodies.end()); }

  void render(const CameraView& view, CameraPicture& out) const override {
    gl_.use();
    const PixelRays& lens = view.samples.front();
    const GLuint frame = frame_of(lens.width, lens.height);
    const Eigen::Vector3f sun = scene_->lights.front().direction_W.cast<float>();
    const Matrix4f to_clip = camera_matrix(view), to_light = light_matrix(sun);
    const bool shaded = view.colour || view.labels;
    if (shaded) {
      glBindFramebuffer(GL_FRAMEBUFFER, shadow_frame_);
      glViewport(0, 0, kShadowSize, kShadowSize);
      glClear(GL_DEPTH_BUFFER_BIT);
      draw(depth_program_, to_light);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glViewport(0, 0, lens.width, lens.height);
    glClear(GL_DEPTH_BUFFER_BIT);
    if (shaded) {
      constexpr GLfloat kBlack[4] = {0, 0, 0, 1};
      constexpr GLuint kNothing[4] = {0, 0, 0, 0};
      glClearBufferfv(GL_COLOR, 0, kBlack);
      glClearBufferuiv(GL_COLOR, 1, kNothing);
      glUseProgram(colour_program_);
      glUniformMatrix4fv(at(colour_program_, "to_light"), 1, GL_FALSE, to_light.data());
      const Eigen::Vector3f towards = -sun.normalized();
      glUniform3fv(at(colour_program_, "towards_light"), 1, towards.data());
      glBindTexture(GL_TEXTURE_2D, shadow_map_);
    }
    draw(shaded ? colour_program_ : depth_program_, to_clip);
    read(view, out);
  }

 private:
  static GLint at(GLuint of_program, const char* name) { return glGetUniformLocation(of_program, name); }

  void draw(GLuint with, const Matrix4f& to_clip) const {
    glUseProgram(with);
    glUniformMatrix4fv(at(with, "to_clip"), 1, GL_FALSE, to_clip.data());
    const GLint to_world = at(with, "to_world"), colour = at(with, "colour"), label = at(with, "label");
    for (const SceneItem& item : scene_->items) {
      const Pose X = poses_[static_cast<std::size_t>(item.body)] * item.X_BM;
      const Matrix4f matrix = X.matrix().cast<float>();
      glUniformMatrix4fv(to_world, 1, GL_FALSE, matrix.data());
      if (colour >= 0)
        glUniform3fv(colour, 1, scene_->materials[static_cast<std::size_t>(item.material)].rgba.data());
      if (label >= 0) glUniform1ui(label, item.label);
      const Mesh& mesh = meshes_[static_cast<std::size_t>(item.mesh)];
      glBindVertexArray(mesh.array);
      glDrawElements(GL_TRIANGLES, mesh.corners, GL_UNSIGNED_INT, nullptr);
    }
  }

  GLuint frame_of(int width, int height) const {
    GLuint& frame = frames_[{width, height}];
    if (frame != 0) return frame;
    glGenFramebuffers(1, &frame);
    const GLuint colour = texture(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height),
                 labels = texture(GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, width, height),
                 depth = texture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, GL_TEXTURE_2D, labels, 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    constexpr GLenum kBoth[2] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    glDrawBuffers(2, kBoth);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("OpenGL has no framebuffer of these formats");
    return frame;
  }

  static void read(const CameraView& view, CameraPicture& out) {
    const int width = view.samples.front().width, height = view.samples.front().height;
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    out.rgb.resize(view.colour ? 3 * pixels : 0);
    out.depth.resize(view.depth ? pixels : 0);
    out.labels.resize(view.labels ? pixels : 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    if (view.depth) {
      glReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, out.depth.data());
      const auto near = static_cast<float>(view.near), far = static_cast<float>(view.far);
      for (float& z : out.depth)
        z = z < 1 ? near * far / (far - z * (far - near)) : std::numeric_limits<float>::infinity();
    }
    if (view.colour) {
      glReadBuffer(GL_COLOR_ATTACHMENT0);
      glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, out.rgb.data());
    }
    if (view.labels) {
      glReadBuffer(GL_COLOR_ATTACHMENT1);
      glReadPixels(0, 0, width, height, GL_RED_INTEGER, GL_UNSIGNED_INT, out.labels.data());
    }
  }

  GlContext gl_;
  std::shared_ptr<const RenderScene> scene_;
  std::vector<Pose> poses_;
  GLuint depth_program_, colour_program_, shadow_map_ = 0, shadow_frame_ = 0;
  std::vector<Mesh> meshes_;
  mutable std::map<std::pair<int, int>, GLuint> frames_;  // by width and height
};

}  // namespace

GlContext::GlContext()
    : display_(eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)) {
  if (display_ == EGL_NO_DISPLAY || eglInitialize(display_, nullptr, nullptr) == EGL_FALSE)
    throw std::runtime_error("EGL has no display without a window: apt-get install libegl1 libgl1-mesa-dri");
  eglBindAPI(EGL_OPENGL_API);
  context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, nullptr);
  if (context_ == EGL_NO_CONTEXT)
    throw std::runtime_error("EGL has no context of OpenGL: apt-get install libgl1-mesa-dri");
  use();
}

void GlContext::use() const {
  if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_FALSE)
    throw std::runtime_error("EGL cannot use a context without a surface");
}

std::unique_ptr<CameraRenderer> make_gl_peer(std::shared_ptr<const RenderScene> scene) {
  return std::make_unique<Gl>(std::move(scene));
}

}  // namespace doppel
