// The ground: a grid that fades with distance, drawn by one shader, and a plane that shows only shadows.
import * as THREE from 'three';

const VERTEX = `
varying vec2 at;
void main() {
  at = (modelMatrix * vec4(position, 1.0)).xy;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const FRAGMENT = `
varying vec2 at;
uniform vec3 colour;
uniform vec3 axisX;
uniform vec3 axisY;
uniform vec2 middle;
uniform float step;
uniform float reach;
float line(vec2 p, float width) {
  vec2 w = fwidth(p);
  vec2 d = abs(fract(p - 0.5) - 0.5);
  vec2 v = 1.0 - smoothstep(w * width, w * (width + 1.0), d);
  return max(v.x * (1.0 - smoothstep(0.25, 0.5, w.x)), v.y * (1.0 - smoothstep(0.25, 0.5, w.y)));
}
void main() {
  float fade = 1.0 - smoothstep(reach * 0.25, reach, length(at - middle));
  float fine = line(at / step, 0.2) * 0.35;
  float coarse = line(at / (step * 10.0), 0.35) * 0.75;
  vec2 w = fwidth(at);
  float x = 1.0 - smoothstep(w.y * 0.7, w.y * 1.7, abs(at.y));
  float y = 1.0 - smoothstep(w.x * 0.7, w.x * 1.7, abs(at.x));
  vec3 c = colour;
  float a = max(fine, coarse);
  if (x > 0.0) { c = mix(c, axisX, x); a = max(a, x * 0.8); }
  if (y > 0.0) { c = mix(c, axisY, y); a = max(a, y * 0.8); }
  gl_FragColor = vec4(c, a * fade);
  #include <colorspace_fragment>
}`;

export class Ground {
  readonly root = new THREE.Group();
  readonly grid: THREE.Mesh;
  readonly shadow: THREE.Mesh;
  private readonly uniforms = {
    colour: { value: new THREE.Color() },
    axisX: { value: new THREE.Color(0xc4472a) },
    axisY: { value: new THREE.Color(0x2f8f5b) },
    middle: { value: new THREE.Vector2() },
    step: { value: 0.1 },
    reach: { value: 4 },
  };

  constructor() {
    this.grid = new THREE.Mesh(
      new THREE.PlaneGeometry(1, 1),
      new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: this.uniforms, transparent: true, depthWrite: false, side: THREE.DoubleSide,
        polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 16 }), // behind a world's own ground
    );
    this.grid.renderOrder = -1;
    this.shadow = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.ShadowMaterial({ opacity: 0.22, depthWrite: false }));
    this.shadow.receiveShadow = true;
    this.shadow.position.z = -0.0005;
    this.grid.position.z = -0.001;
    this.root.add(this.grid); // the shadow's plane where shadows are on
  }

  // For a robot of this size, in metres.
  fit(size: number): void {
    const reach = Math.max(2, size * 6);
    this.uniforms.reach.value = reach;
    this.uniforms.step.value = size > 8 ? 1 : size > 0.25 ? 0.1 : 0.01;
    this.grid.scale.setScalar(reach * 2);
    this.shadow.scale.setScalar(reach * 2);
  }

  // Above the origin of the picture, in metres.
  get height(): number {
    return this.root.position.z;
  }

  // Its pose in the picture (x y z qx qy qz qw); null: at the origin.
  stand(pose: ArrayLike<number> | null): void {
    this.root.position.set(pose?.[0] ?? 0, pose?.[1] ?? 0, pose?.[2] ?? 0);
    this.root.quaternion.set(pose?.[3] ?? 0, pose?.[4] ?? 0, pose?.[5] ?? 0, pose?.[6] ?? 1);
  }

  colour(line: string, shadowOpacity: number): void {
    this.uniforms.colour.value.set(line);
    (this.shadow.material as THREE.ShadowMaterial).opacity = shadowOpacity;
  }
}
