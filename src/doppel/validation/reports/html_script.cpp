#include "doppel/validation/reports/detail/html_pieces.h"

namespace doppel {

namespace {

// The picture is that of arm_drawing(): orthographic, with the same axes, colours, outlines and names.
constexpr std::string_view kScript = R"js(
'use strict';
(() => {
  for (const button of document.querySelectorAll('button.copy')) {
    button.hidden = false;
    button.addEventListener('click', async () => {
      const code = button.previousElementSibling;
      try {
        await navigator.clipboard.writeText(code.textContent);
        button.textContent = 'Copied';
      } catch {
        getSelection().selectAllChildren(code);
        button.textContent = document.execCommand('copy') ? 'Copied' : 'Selected';
      }
      setTimeout(() => { button.textContent = 'Copy'; }, 1500);
    });
  }
  let closed = [];
  addEventListener('beforeprint', () => {
    closed = [...document.querySelectorAll('details:not([open])')];
    for (const one of closed) one.open = true;
  });
  addEventListener('afterprint', () => { for (const one of closed) one.open = false; });
  const openTarget = () => {
    const name = decodeURIComponent(location.hash.slice(1));
    const target = name && document.getElementById(name);
    if (target instanceof HTMLDetailsElement) target.open = true;
  };
  addEventListener('hashchange', openTarget);
  openTarget();

  const source = document.getElementById('arm');
  if (!source) return;
  const scene = JSON.parse(source.textContent);
  const surface = document.createElement('canvas');
  const gl = surface.getContext('webgl2', { antialias: true, stencil: true, preserveDrawingBuffer: true });
  if (!gl) return;

  const shader = (type, text) => {
    const one = gl.createShader(type);
    gl.shaderSource(one, text);
    gl.compileShader(one);
    return one;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    layout(location = 0) in vec3 corner;
    uniform vec3 low, size, centre, right, up, eye;
    uniform mat4 pose;
    uniform vec2 scale, shift;
    uniform float depth;
    out vec3 seen;
    void main() {
      vec3 p = (pose * vec4(low + corner * size, 1.0)).xyz - centre;
      seen = vec3(dot(right, p), dot(up, p), dot(eye, p));
      gl_Position = vec4(seen.xy * scale + shift, -seen.z * depth, 1.0);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float;
    in vec3 seen;
    uniform vec3 colour;
    uniform float lit;
    out vec4 pixel;
    void main() {
      vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
      float light = 0.4 + 0.6 * max(0.0, dot(n, normalize(vec3(-0.4, 0.7, 1.0))));
      pixel = vec4(colour * mix(1.0, light, lit), 1.0);
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);
  const at = {};
  const uniforms = 'low size centre right up eye pose scale shift depth colour lit';
  for (const name of uniforms.split(' ')) at[name] = gl.getUniformLocation(program, name);

  const words = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Uint16Array(bytes.buffer);
  };
  const mesh = (corners, normalised, type, indices) => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, type, normalised, 0, 0);
    if (indices) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    return { array, count: indices ? indices.length : corners.length / 3 };
  };
  for (const link of scene.links) {
    Object.assign(link, mesh(words(link.corners), true, gl.UNSIGNED_SHORT, words(link.triangles)));
    link.middle = link.low.map((v, i) => v + link.size[i] / 2);
  }
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(1, 1, 1, 1);

  const column = (x, i) => [...x.slice(i, i + 3), i === 9 ? 1 : 0];
  const matrix = (x) => new Float32Array([0, 3, 6, 9].flatMap((i) => column(x, i)));
  const identity = matrix([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const moved = (x, p) => [0, 1, 2].map((i) => x[i] * p[0] + x[3 + i] * p[1] + x[6 + i] * p[2] + x[9 + i]);

  // Lines of the root's x and y, about five to the radius.
  const grid = ({ radius, centre }) => {
    const power = 10 ** Math.floor(Math.log10(radius / 5));
    const step = power * (radius / 5 < 2 * power ? 1 : radius / 5 < 5 * power ? 2 : 5);
    const count = Math.ceil(radius / step);
    const [x, y] = centre.map((v) => step * Math.round(v / step));
    const half = step * count;
    const points = [];
    for (let i = -count; i <= count; i += 1) {
      points.push(x + i * step, y - half, 0, x + i * step, y + half, 0);
      points.push(x - half, y + i * step, 0, x + half, y + i * step, 0);
    }
    return mesh(new Float32Array(points), false, gl.FLOAT);
  };

  class Arm {
    constructor(figure) {
      this.figure = figure;
      this.pose = scene.poses[Number(figure.dataset.pose)];
      this.yaw = this.pose.yaw;
      this.pitch = this.pose.pitch;
      this.zoom = 1;
      this.canvas = document.createElement('canvas');
      this.canvas.tabIndex = 0;
      this.canvas.setAttribute('role', 'img');
      this.canvas.setAttribute('aria-label', `${figure.dataset.caption}. Arrow keys rotate, + and - zoom.`);
      figure.append(this.canvas);
      this.grid = grid(this.pose);
      this.listen();
      figure.classList.add('live');
    }

    listen() {
      let last = null;
      this.canvas.addEventListener('pointerdown', (event) => {
        last = event;
        this.canvas.setPointerCapture(event.pointerId);
      });
      this.canvas.addEventListener('pointermove', (event) => {
        if (!last) return;
        this.turn((last.clientX - event.clientX) * 0.01, (event.clientY - last.clientY) * 0.01);
        last = event;
      });
      for (const name of ['pointerup', 'pointercancel']) {
        this.canvas.addEventListener(name, () => { last = null; });
      }
      this.canvas.addEventListener('keydown', (event) => {
        const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
        const zooms = { '+': 1.15, '=': 1.15, '-': 1 / 1.15 };
        if (turns[event.key]) this.turn(...turns[event.key]);
        else if (zooms[event.key]) this.zoom = Math.min(8, Math.max(0.5, this.zoom * zooms[event.key]));
        else return;
        event.preventDefault();
        this.draw();
      });
      this.canvas.addEventListener('dblclick', () => {
        Object.assign(this, { yaw: this.pose.yaw, pitch: this.pose.pitch, zoom: 1 });
        this.draw();
      });
    }

    turn(yaw, pitch) {
      this.yaw += yaw;
      this.pitch = Math.min(1.57, Math.max(-1.57, this.pitch + pitch));
      this.draw();
    }

    draw() {
      const width = Math.round(this.canvas.clientWidth * devicePixelRatio);
      const height = Math.round(this.canvas.clientHeight * devicePixelRatio);
      if (!width || !height) return;
      if (surface.width !== width || surface.height !== height) Object.assign(surface, { width, height });
      Object.assign(this.canvas, { width, height });
      const [cy, sy] = [Math.cos(this.yaw), Math.sin(this.yaw)];
      const [cp, sp] = [Math.cos(this.pitch), Math.sin(this.pitch)];
      this.axes = [[-sy, cy, 0], [-sp * cy, -sp * sy, cp], [cp * cy, cp * sy, sp]];
      const scale = 0.94 * this.zoom / this.pose.radius;
      this.scale = [scale * height / width, scale];
      gl.viewport(0, 0, width, height);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
      gl.uniform3fv(at.centre, this.pose.centre);
      gl.uniform3fv(at.right, this.axes[0]);
      gl.uniform3fv(at.up, this.axes[1]);
      gl.uniform3fv(at.eye, this.axes[2]);
      gl.uniform2fv(at.scale, this.scale);
      gl.uniform1f(at.depth, 0.5 / this.pose.radius);
      this.ground();
      scene.links.forEach((link, i) => this.link(link, i, this.colour(link, i), 1, [0, 0]));
      this.outlines(width, height);
      const picture = this.canvas.getContext('2d');
      picture.drawImage(surface, 0, 0);
      this.names(picture, width, height);
    }

    colour(link, i) {
      const rank = this.pose.named.indexOf(i);
      if (rank >= 0) return scene.colours[rank % scene.colours.length];
      return this.pose.named.length === 0 ? link.colour : link.colour.map((v) => 0.25 * v + 0.6);
    }

    // Behind the arm, also where that is below it.
    ground() {
      gl.uniformMatrix4fv(at.pose, false, identity);
      gl.uniform3f(at.low, 0, 0, 0);
      gl.uniform3f(at.size, 1, 1, 1);
      gl.uniform2f(at.shift, 0, 0);
      gl.uniform3f(at.colour, 0.835, 0.855, 0.878);
      gl.uniform1f(at.lit, 0);
      gl.bindVertexArray(this.grid.array);
      gl.disable(gl.DEPTH_TEST);
      gl.drawArrays(gl.LINES, 0, this.grid.count);
      gl.enable(gl.DEPTH_TEST);
    }

    link(link, i, colour, lit, shift) {
      gl.uniformMatrix4fv(at.pose, false, matrix(this.pose.links[i]));
      gl.uniform3fv(at.low, link.low);
      gl.uniform3fv(at.size, link.size);
      gl.uniform2fv(at.shift, shift);
      gl.uniform3fv(at.colour, colour);
      gl.uniform1f(at.lit, lit);
      gl.bindVertexArray(link.array);
      gl.drawElements(gl.TRIANGLES, link.count, gl.UNSIGNED_SHORT, 0);
    }

    // Around each named link, also where another one hides it: its picture shifted to all sides, less itself.
    outlines(width, height) {
      gl.disable(gl.DEPTH_TEST);
      gl.enable(gl.STENCIL_TEST);
      this.pose.named.forEach((i) => {
        gl.clear(gl.STENCIL_BUFFER_BIT);
        gl.stencilFunc(gl.ALWAYS, 1, 1);
        gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
        gl.colorMask(false, false, false, false);
        this.link(scene.links[i], i, [0, 0, 0], 0, [0, 0]);
        gl.colorMask(true, true, true, true);
        gl.stencilFunc(gl.EQUAL, 0, 1);
        gl.stencilOp(gl.KEEP, gl.KEEP, gl.KEEP);
        for (let k = 0; k < 12; k += 1) {
          const d = 2 * 1.7 * devicePixelRatio;
          const shift = [Math.cos(k * Math.PI / 6) * d / width, Math.sin(k * Math.PI / 6) * d / height];
          this.link(scene.links[i], i, [0.07, 0.07, 0.07], 0, shift);
        }
      });
      gl.disable(gl.STENCIL_TEST);
      gl.enable(gl.DEPTH_TEST);
    }

    // At the sides, with a line to the middle of the link.
    names(picture, width, height) {
      const unit = width / 640;
      const marks = this.pose.named.map((i) => {
        const p = moved(this.pose.links[i], scene.links[i].middle).map((v, k) => v - this.pose.centre[k]);
        return {
          name: scene.links[i].name,
          x: width / 2 * (1 + dot(this.axes[0], p) * this.scale[0]),
          y: height / 2 * (1 - dot(this.axes[1], p) * this.scale[1]),
        };
      }).sort((a, b) => a.x - b.x);
      const size = Math.max(17 * unit, 13 * devicePixelRatio);
      picture.font = `600 ${size}px system-ui, sans-serif`;
      picture.lineJoin = 'round';
      marks.forEach(({ name, x, y }, i) => {
        const left = 2 * i < marks.length;
        const row = left ? i : marks.length - 1 - i;
        const place = [left ? 10 * unit : width - 10 * unit, size * 1.5 * (row + 1)];
        picture.strokeStyle = picture.fillStyle = '#111';
        picture.lineWidth = devicePixelRatio;
        picture.beginPath();
        picture.moveTo(place[0] + (left ? 4 : -4) * unit, place[1] + 5 * unit);
        picture.lineTo(x, y);
        picture.stroke();
        picture.beginPath();
        picture.arc(x, y, 4 * unit, 0, 7);
        picture.fill();
        picture.textAlign = left ? 'left' : 'right';
        picture.strokeStyle = '#fff';
        picture.lineWidth = 4 * unit;
        picture.strokeText(name, ...place);
        picture.fillText(name, ...place);
      });
    }
  }

  const arms = new Map();
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      if (!arms.has(target)) arms.set(target, new Arm(target));
      arms.get(target).draw();
    }
  }, { rootMargin: '200px' });
  for (const figure of document.querySelectorAll('.arm[data-pose]')) seen.observe(figure);
  addEventListener('resize', () => { for (const arm of arms.values()) arm.draw(); });
})();
)js";

}  // namespace

std::string_view report_script() {
  return kScript;
}

}  // namespace doppel
