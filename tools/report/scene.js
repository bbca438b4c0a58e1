"use strict";
// The 3D view: reads the scene's JSON, draws it with three.js and turns it with mouse, touch or keyboard.
// Drawn only when something changes. Coordinates are the report's: mm, z up.
(() => {
  const host = document.getElementById("scene");
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const note = document.getElementById("scene-note");
  let renderer;
  try {
    const canvas = document.createElement("canvas");
    const context = canvas.getContext("webgl", {antialias: true});
    if (!context) throw new Error("no WebGL");
    renderer = new THREE.WebGLRenderer({canvas, context, antialias: true});
  } catch (error) {
    note.hidden = false;
    document.getElementById("scene-still").classList.remove("print-only");
    document.getElementById("scene-controls").hidden = true;
    host.hidden = true;
    return;
  }
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "3D view. Arrow keys turn it, plus and minus zoom, 0 resets.");
  host.append(canvas);

  const ink = (name) => new THREE.Color(getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim());
  const vector = (p) => new THREE.Vector3(p[0], p[1], p[2]);
  const root = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera(35, 1, 1, 1e6);
  camera.up.set(0, 0, 1);
  const centre = vector(data.centre);
  const home = {turn: -0.9, lift: 0.35, distance: Math.max(data.radius * 3.3, data.far * 2)};
  const view = {...home};
  let pose = data.shown;

  function lines(points, name, opacity = 1) {
    const geometry = new THREE.BufferGeometry().setFromPoints(points);
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: ink(name), transparent: opacity < 1, opacity}));
  }
  function rod(a, b, radius, name) {
    const length = a.distanceTo(b);
    const mesh = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, length, 12), new THREE.MeshBasicMaterial({color: ink(name)}));
    mesh.position.copy(a).add(b).multiplyScalar(0.5);
    mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), b.clone().sub(a).normalize());
    return mesh;
  }
  // Labels keep their size on the screen, near or far: `size` is a share of the view's height.
  function label(words, at, name, size) {
    const picture = document.createElement("canvas");
    const pen = picture.getContext("2d");
    const font = "600 40px system-ui, sans-serif";
    pen.font = font;
    picture.width = Math.ceil(pen.measureText(words).width) + 8;
    picture.height = 52;
    pen.font = font;
    pen.fillStyle = "#" + ink(name).getHexString();
    pen.fillText(words, 4, 40);
    const texture = new THREE.CanvasTexture(picture);
    texture.minFilter = THREE.LinearFilter;
    const sprite = new THREE.Sprite(new THREE.SpriteMaterial({map: texture, depthTest: false, sizeAttenuation: false}));
    sprite.scale.set(size * picture.width / picture.height, size, 1);
    sprite.position.copy(at);
    return sprite;
  }
  function quad(corners, name) {
    const [a, b, c, d] = corners.map(vector);
    const geometry = new THREE.BufferGeometry().setFromPoints([a, b, c, a, c, d]);
    const group = new THREE.Group();
    group.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({color: ink(name), side: THREE.DoubleSide, transparent: true, opacity: 0.55})));
    group.add(lines([a, b, b, c, c, d, d, a], name));
    return group;
  }
  function frame(item) {
    const group = new THREE.Group();
    const origin = vector(item.origin);
    const names = ["s1", "s2", "s0"];
    ["x", "y", "z"].forEach((axis, i) => {
      const tip = origin.clone().addScaledVector(vector(item.axes[i]), data.radius * 0.16);
      group.add(rod(origin, tip, data.radius * 0.004, names[i]));
      group.add(label(axis, tip, names[i], 0.018));
    });
    const name = label(item.name, origin, "text", 0.024);
    name.center.set(1.2, item.name === "LG" ? 1.3 : -0.3);  // the two grips lie close
    group.add(name);
    return group;
  }
  function station(item) {
    const group = new THREE.Group();
    const apex = vector(item.centre);
    const corners = item.corners.map(vector);
    const points = [];
    corners.forEach((corner, i) => points.push(apex, corner, corner, corners[(i + 1) % 4]));
    group.add(lines(points, "s6"));
    const name = label(item.name, apex, "muted", 0.018);
    name.center.set(0.5, -0.6);
    group.add(name);
    return group;
  }
  function ellipsoid(item) {
    const mesh = new THREE.Mesh(new THREE.SphereGeometry(1, 20, 14), new THREE.MeshBasicMaterial({color: ink("s1"), transparent: true, opacity: 0.5, depthWrite: false}));
    const [u, v, w] = item.axes.map(vector);
    mesh.matrixAutoUpdate = false;
    mesh.matrix.makeBasis(u, v, w).setPosition(vector(item.centre));
    return mesh;
  }

  function rebuild() {
    root.traverse((item) => {
      if (item.geometry) item.geometry.dispose();
      if (item.material && item.material.map) item.material.map.dispose();
      if (item.material) item.material.dispose();
    });
    root.remove(...root.children);
    root.background = ink("surface");
    for (const item of data.fixed.frames) root.add(frame(item));
    for (const item of data.fixed.markers) root.add(quad(item.corners, "s0"));
    const body = data.fixed.joints.map(vector);
    const ring = (points) => points.flatMap((p, i) => [p, points[(i + 1) % points.length]]);
    if (body.length) root.add(lines(ring(body), "muted"));
    const now = data.poses[pose];
    if (now) {
      for (const item of now.frames) root.add(frame(item));
      for (const item of now.markers) root.add(quad(item.corners, "s2"));
      for (const item of now.cameras) root.add(station(item));
      for (const item of now.ellipsoids) root.add(ellipsoid(item));
      const platform = now.joints.map(vector);
      if (platform.length) root.add(lines(ring(platform), "muted"));
      platform.forEach((joint, i) => {
        root.add(rod(body[i], joint, data.radius * 0.008, "s4"));
        root.add(label(String(i + 1), body[i].clone().lerp(joint, 0.5), "text", 0.02));
      });
    }
    draw();
  }
  function draw() {
    const width = host.clientWidth;
    const height = canvas.clientHeight || 400;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.near = view.distance / 100;
    camera.far = view.distance * 20;
    camera.updateProjectionMatrix();
    const flat = Math.cos(view.lift) * view.distance;
    camera.position.set(centre.x + Math.cos(view.turn) * flat, centre.y + Math.sin(view.turn) * flat, centre.z + Math.sin(view.lift) * view.distance);
    camera.lookAt(centre);
    renderer.render(root, camera);
  }
  function turn(by, lift) {
    view.turn += by;
    view.lift = Math.max(-1.55, Math.min(1.55, view.lift + lift));
    draw();
  }
  function zoom(factor) {
    view.distance = Math.max(data.radius * 0.3, Math.min(data.radius * 15, view.distance * factor));
    draw();
  }
  function reset() { Object.assign(view, home); draw(); }

  // Pointers: one turns, two zoom by their distance.
  const pointers = new Map();
  const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a.x - b.x, a.y - b.y); };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  });
  canvas.addEventListener("pointermove", (event) => {
    const last = pointers.get(event.pointerId);
    if (!last) return;
    const before = pointers.size === 2 ? spread() : 0;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (pointers.size === 1) turn(-dx * 0.008, dy * 0.008);
    if (pointers.size === 2 && spread() > 0) zoom(before / spread());
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  // The wheel scrolls the page until the view was clicked, so that nobody gets stuck on it.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(event.deltaY * 0.001));
  }, {passive: false});
  canvas.addEventListener("keydown", (event) => {
    const actions = {
      ArrowLeft: () => turn(0.1, 0), ArrowRight: () => turn(-0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
      "+": () => zoom(0.9), "=": () => zoom(0.9), "-": () => zoom(1.1), "0": reset,
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
  const buttons = {"scene-left": () => turn(0.25, 0), "scene-right": () => turn(-0.25, 0), "scene-in": () => zoom(0.8), "scene-out": () => zoom(1.25), "scene-reset": reset};
  for (const [id, action] of Object.entries(buttons)) document.getElementById(id).addEventListener("click", action);
  const select = document.getElementById("scene-pose");
  select.value = String(pose);
  select.addEventListener("change", () => { pose = Number(select.value); rebuild(); });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", rebuild);
  new ResizeObserver(draw).observe(host);
  rebuild();
  host.dataset.ready = "true";
})();
