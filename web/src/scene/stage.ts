// Renderer, lights, ground and the drawing loop: a frame only when something has changed, at a resolution that the
// machine can sustain.

import * as THREE from 'three';
import { Signal } from '../app/signal';
import { materialOf, useSimpleMaterials } from '../robot/materials';
import { Ground } from './ground';

// True if WebGL is rendered by the processor; ?quality=high or low in the address overrides this.
function isSoftware(context: WebGL2RenderingContext): boolean {
  const wanted = new URLSearchParams(location.search).get('quality');
  if (wanted === 'high' || wanted === 'low') return wanted === 'low';
  const info = context.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(context.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

// Antialiasing is chosen when the context is created, so a graphics card gets a second context, which costs nothing
// there.
function makeRenderer(): { renderer: THREE.WebGLRenderer; software: boolean; drawable: boolean } {
  const make = (antialias: boolean): { canvas: HTMLCanvasElement; context: WebGL2RenderingContext; antialias: boolean } | null => {
    const canvas = document.createElement('canvas');
    const context = canvas.getContext('webgl2', { alpha: true, antialias, powerPreference: 'high-performance' });
    return context && { canvas, context, antialias };
  };
  let made = make(false);
  if (!made) return { renderer: withoutPicture(), software: true, drawable: false };
  const software = isSoftware(made.context);
  if (!software) {
    made.context.getExtension('WEBGL_lose_context')?.loseContext();
    made = make(true) ?? made;
  }
  const renderer = new THREE.WebGLRenderer({ ...made, alpha: true });
  renderer.debug.checkShaderErrors = false; // reading it waits for the compiler
  return { renderer, software, drawable: true };
}

// The members of a renderer that the page uses, for a browser without WebGL 2: panels and STOP work without it.
function withoutPicture(): THREE.WebGLRenderer {
  const none = (): void => {};
  return {
    domElement: document.createElement('canvas'), shadowMap: {}, debug: {}, render: none, compile: none, setSize: none,
    setPixelRatio: none, getPixelRatio: () => 1,
  } as unknown as THREE.WebGLRenderer;
}

// The lights of a world instead of the page's own.
export interface WorldLight {
  sun: { colour: THREE.Color; intensity: number; direction: THREE.Vector3; shadows: boolean } | null;
  ambient: THREE.Color;
  ambientIntensity: number;
  shadows: boolean;
}

const SUN_FROM = new THREE.Vector3(1.1, -1.4, 2.4); // of the page's own light

export class Stage {
  readonly scene = new THREE.Scene();
  readonly camera = new THREE.PerspectiveCamera(38, 1, 0.005, 200);
  readonly renderer: THREE.WebGLRenderer;
  readonly software: boolean;
  readonly drawable: boolean; // false: the browser has no WebGL 2, and nothing is drawn
  readonly ground = new Ground();
  readonly sun = new THREE.DirectionalLight(0xffffff, 2.4);
  readonly sky = new THREE.HemisphereLight(0xffffff, 0x8a8f98, 1.5);
  readonly frame = new Signal<number>(); // before each frame that is drawn; s since the last
  readonly tick = new Signal<number>(); // for every animation frame, drawn or not
  frameTime = 0; // ms, smoothed: from the start to the end of drawing, measured on the CPU
  frames = 0;
  private readonly fillLight = new THREE.DirectionalLight(0xdfe8ff, 0.7);
  private worldLight: WorldLight | null = null;
  private wantsShadows = false;
  private themed = { sun: 2.4, sky: 1.5 }; // intensities of the page's own lights
  private fitted = { centre: new THREE.Vector3(), size: 1 };
  private begun = false;
  private dirty = true;
  private ratio = Math.min(devicePixelRatio || 1, 2);
  private slow = 0;
  private tooSlow = false; // for shadows
  private last = performance.now();

  constructor(readonly host: HTMLElement) {
    THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
    this.camera.up.set(0, 0, 1);
    const { renderer, software, drawable } = makeRenderer();
    this.drawable = drawable;
    this.renderer = renderer;
    this.software = software;
    const { scene, sun } = this;
    renderer.setPixelRatio(this.ratio);
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = this.software ? THREE.BasicShadowMap : THREE.PCFSoftShadowMap;
    renderer.shadowMap.autoUpdate = false;
    if (this.software) useSimpleMaterials();
    renderer.toneMapping = THREE.ACESFilmicToneMapping;
    renderer.toneMappingExposure = 1.05;
    renderer.domElement.className = 'view3d';
    renderer.domElement.tabIndex = 0;
    renderer.domElement.setAttribute('role', 'img');
    renderer.domElement.setAttribute('aria-label', 'The robot in 3D. Drag to turn, right drag to move, wheel to zoom; or arrows, shift and arrows, Page Up and Page Down.');
    host.prepend(renderer.domElement);
    sun.shadow.mapSize.setScalar(this.software ? 512 : 1024);
    sun.shadow.bias = -0.0004;
    sun.shadow.normalBias = 0.002;
    this.fillLight.position.set(-2, -1.5, 1);
    this.sky.position.set(0, 0, 1);
    scene.add(this.sky, sun, sun.target, this.fillLight, this.ground.root);
    this.compileEarly();
    new ResizeObserver(() => this.resize()).observe(host);
    this.resize();
    requestAnimationFrame(this.loop);
  }

  invalidate = (): void => {
    this.dirty = true;
  };

  // Nothing is drawn before there is content.
  begin(): void {
    this.begun = true;
    this.dirty = true;
  }

  // Calls back when the last frame has actually been drawn, not only submitted to the graphics process.
  finished(done: () => void): void {
    if (!this.drawable) {
      done();
      return;
    }
    const context = this.renderer.getContext() as WebGL2RenderingContext;
    const fence = context.fenceSync(context.SYNC_GPU_COMMANDS_COMPLETE, 0);
    context.flush();
    const look = (): void => {
      const state = fence ? context.clientWaitSync(fence, 0, 0) : context.ALREADY_SIGNALED;
      if (state === context.TIMEOUT_EXPIRED) {
        setTimeout(look, 4);
        return;
      }
      context.deleteSync(fence);
      done();
    };
    look();
  }

  // An object that casts a shadow has moved.
  moved(): void {
    this.renderer.shadowMap.needsUpdate = true;
    this.dirty = true;
  }

  // Lights and ground for a robot of this size around this point.
  fit(centre: THREE.Vector3, size: number): void {
    const { sun } = this;
    this.fitted = { centre: centre.clone(), size };
    this.placeSun();
    const box = sun.shadow.camera;
    box.left = box.bottom = -size * 1.3;
    box.right = box.top = size * 1.3;
    box.near = size * 0.2;
    box.far = size * 8;
    box.updateProjectionMatrix();
    this.ground.fit(size);
    this.camera.near = Math.max(0.001, size / 200);
    this.camera.far = Math.max(50, size * 100);
    this.camera.updateProjectionMatrix();
    this.moved();
  }

  private placeSun(): void {
    const { centre, size } = this.fitted;
    const direction = this.worldLight?.sun?.direction;
    const from = direction ? direction.clone().normalize().multiplyScalar(-SUN_FROM.length()) : SUN_FROM;
    this.sun.position.copy(centre).addScaledVector(from, size);
    this.sun.target.position.copy(centre);
  }

  // The lights of a world; null: the page's own.
  lightBy(light: WorldLight | null): void {
    this.worldLight = light;
    this.renderer.toneMapping = light ? THREE.NoToneMapping : THREE.ACESFilmicToneMapping; // a world's colours are as written
    this.fillLight.visible = light === null;
    this.sun.visible = light === null || light.sun !== null;
    this.sun.color.copy(light?.sun?.colour ?? new THREE.Color(0xffffff));
    this.sky.color.copy(light?.ambient ?? new THREE.Color(0xffffff));
    this.sky.groundColor.copy(light?.ambient ?? new THREE.Color(0x8a8f98));
    this.applyIntensities();
    this.placeSun();
    this.shadows(this.wantsShadows);
    this.moved();
  }

  // Intensities of the page's own lights.
  theme(sun: number, sky: number): void {
    this.themed = { sun, sky };
    this.applyIntensities();
  }

  private applyIntensities(): void {
    this.sun.intensity = this.worldLight?.sun?.intensity ?? this.themed.sun;
    this.sky.intensity = this.worldLight?.ambientIntensity ?? this.themed.sky;
    this.invalidate();
  }

  shadows(wanted: boolean): void {
    this.wantsShadows = wanted;
    const { worldLight } = this;
    const on = wanted && !this.tooSlow && (worldLight === null || (worldLight.shadows && worldLight.sun?.shadows === true));
    if (on === this.sun.castShadow) return;
    this.sun.castShadow = on;
    if (on) this.ground.root.add(this.ground.shadow);
    else this.ground.shadow.removeFromParent();
    this.moved();
  }

  // The graphics process compiles while the meshes are still loading.
  private compileEarly(): void {
    const sample = new THREE.Mesh(new THREE.BufferGeometry(), materialOf(null));
    this.scene.add(sample);
    this.renderer.compile(this.scene, this.camera);
    this.scene.remove(sample);
  }

  private resize(): void {
    const { clientWidth: w, clientHeight: h } = this.host;
    if (w === 0 || h === 0) return;
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    if (this.begun) this.draw(0);
  }

  private draw(dt: number): void {
    this.dirty = false;
    this.frame.emit(dt);
    const start = performance.now();
    this.renderer.render(this.scene, this.camera);
    const took = performance.now() - start;
    this.frameTime = this.frameTime === 0 ? took : this.frameTime * 0.9 + took * 0.1;
    this.frames += 1;
  }

  private readonly loop = (now: number): void => {
    requestAnimationFrame(this.loop);
    const dt = Math.min(0.25, (now - this.last) / 1000);
    this.last = now;
    this.tick.emit(dt);
    if (!this.dirty || !this.begun) {
      this.slow = 0;
      return;
    }
    this.draw(dt);
    this.adapt(dt);
  };

  // After several late frames in a row (software rendering): fewer pixels, then no shadows.
  private adapt(dt: number): void {
    this.slow = dt > 0.045 ? this.slow + 1 : Math.max(0, this.slow - 2);
    if (this.slow < (this.software ? 6 : 20) || location.search.includes('quality=high')) return;
    this.slow = 0;
    if (this.ratio <= 0.6) {
      this.tooSlow = true;
      this.shadows(false);
      return;
    }
    this.ratio = Math.max(0.6, this.ratio * 0.8);
    this.renderer.setPixelRatio(this.ratio);
    this.resize();
  }
}
