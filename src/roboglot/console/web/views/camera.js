// The camera: live video with sound by WebRTC, motion JPEG and WAV where that fails, with what the robot makes out drawn over it.
import { useEffect, useRef } from "preact/hooks";
import { signal, useSignal } from "@preact/signals";
import { Button, html, robotWord, say, t, translated } from "../base.js";
import { saveAs } from "../copies.js";
import { connections, current, seen, state, status, want } from "../link.js";

const FILM_RATE = 15; // pictures a second
const FILM_MAX = 600_000; // ms
const filming = signal(/** @type {(() => void) | null} */ (null));
const filmed = signal(0); // bytes of the film so far
const LOOK = 200; // ms between two looks for the first picture
const AGAIN = 1000; // ms after a broken film
const CONNECT_MAX = 5000; // ms until motion JPEG takes the place of the call
const shown = signal(false);
const boxes = signal(true);
const hears = signal(false); // whether the call carries sound
const loud = signal(false);

/** Call the robot's camera; the promise is the peer, or fails. @param {HTMLVideoElement} video @param {string} robot */
async function call(video, robot) {
  const peer = new RTCPeerConnection();
  peer.addTransceiver("video", { direction: "recvonly" });
  peer.addTransceiver("audio", { direction: "recvonly" });
  video.srcObject = new MediaStream();
  peer.ontrack = ({ track }) => {
    /** @type {MediaStream} */ (video.srcObject).addTrack(track);
    if (track.kind === "audio") track.onunmute = () => { hears.value = true; };
  };
  try {
    await peer.setLocalDescription();
    await gathered(peer);
    if (!peer.localDescription?.sdp.includes("a=candidate")) throw new Error("no network"); // browsers do not call over loopback alone
    const reply = await fetch(`/api/robots/${robot}/camera/call`, { method: "POST", body: JSON.stringify({ offer: peer.localDescription?.sdp }) });
    const words = await reply.json();
    if (!reply.ok) throw new Error(words.error);
    await peer.setRemoteDescription({ type: "answer", sdp: words.answer });
    await connected(peer);
    return peer;
  } catch (error) {
    peer.close();
    throw error;
  }
}

/** @param {RTCPeerConnection} peer */
function gathered(peer) {
  return new Promise((resolve) => {
    const look = () => { if (peer.iceGatheringState === "complete") resolve(undefined); };
    peer.onicegatheringstatechange = look;
    setTimeout(resolve, 1000);
    look();
  });
}

/** @param {RTCPeerConnection} peer */
function connected(peer) {
  return new Promise((resolve, reject) => {
    const late = setTimeout(() => reject(new Error("no connection")), CONNECT_MAX);
    peer.onconnectionstatechange = () => {
      if (peer.connectionState === "connected") { clearTimeout(late); resolve(undefined); }
      if (peer.connectionState === "failed") { clearTimeout(late); reject(new Error("no connection")); }
    };
  });
}

function Boxes() {
  if (!boxes.value) return null;
  return html`<svg class="boxes" viewBox="0 0 1 1" preserveAspectRatio="none" aria-hidden="true">${seen.value.map(([kind, , x, y, w, h]) => html`
      <rect class=${kind} x=${x - w / 2} y=${y - h / 2} width=${w} height=${h} />`)}</svg>
    ${seen.value.map(([kind, label, x, y, w, h]) => html`<span class="sighting" style=${{ ...(x > 0.6 ? { right: `${Math.max(0, 1 - x - w / 2) * 100}%` } : { left: `${Math.max(0, x - w / 2) * 100}%` }), top: `${Math.max(0, y - h / 2) * 100}%` }}>
      ${robotWord(kind)}${label ? ` ${robotWord(label)}` : ""}</span>`)}`;
}

/** Why no picture is seen, or no new one; empty once there are. @param {boolean} there */
function missing(there) {
  if (status.value !== "open") return t("link.lost");
  return there ? "" : translated(state.value?.body.camera ?? "") || t("camera.waits");
}

function Picture({ robot, again }) {
  const video = useRef(null), screen = useRef(/** @type {any} */ (null)), plain = useSignal(false), there = useSignal(false);
  useEffect(() => {
    let peer = null, gone = false;
    const look = setInterval(() => { const shown = screen.current?.querySelector("video, img"); there.value = Boolean(shown?.videoWidth || shown?.naturalWidth); }, LOOK);
    const broken = () => { if (!gone && ["failed", "closed"].includes(peer.connectionState)) again(); };
    call(video.current, robot).then((made) => { if (gone) { made.close(); return; } peer = made; peer.onconnectionstatechange = broken; }, () => { if (!gone) plain.value = true; });
    want({ seen: true });
    return () => { filming.value?.(); gone = true; clearInterval(look); hears.value = false; peer?.close(); want({ seen: false }); };
  }, [robot]);
  const why = missing(there.value);
  return html`<div class="screen" ref=${screen}>${plain.value ? html`<img src=${`/api/robots/${robot}/camera.mjpeg`} alt=${t("camera.alt")} onError=${() => setTimeout(again, AGAIN)} />${state.value?.parts.includes("microphone") && html`<audio src=${`/api/robots/${robot}/sound.wav`} autoplay muted=${!loud.value} onPlaying=${() => { hears.value = true; }}></audio>`}`
    : html`<video ref=${video} autoplay playsinline muted=${!loud.value} aria-label=${t("camera.alt")}></video>`}${why ? html`<p class="why" role="status">${why}</p>` : html`<${Boxes} />`}</div>`;
}

/** What is heard beside a picture; a browser that cannot tap it films in silence. @param {Element} screen @returns {MediaStreamTrack[]} */
function heard(screen) {
  const sound = /** @type {any} */ (screen.querySelector("video, audio"));
  return (sound?.srcObject ?? sound?.captureStream?.() ?? sound?.mozCaptureStream?.())?.getAudioTracks() ?? [];
}

/** What films a stream; null in a browser that cannot. @param {MediaStream} stream */
function recorderOf(stream) {
  try { return new MediaRecorder(stream); } catch { return null; }
}

/** Film what is on the screen until it is called again; then the file is saved. @param {Element} screen @param {string} robot */
function film(screen, robot) {
  const canvas = document.createElement("canvas"), context = canvas.getContext("2d");
  const draw = () => {
    const picture = /** @type {any} */ (screen.querySelector("video, img"));
    const [width, height] = [picture?.videoWidth || picture?.naturalWidth, picture?.videoHeight || picture?.naturalHeight];
    if (!width) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    context?.drawImage(picture, 0, 0);
  };
  draw();
  const recorder = recorderOf(new MediaStream([...canvas.captureStream(FILM_RATE).getTracks(), ...heard(screen)])), parts = /** @type {Blob[]} */ ([]);
  if (!recorder) { say(t("film.empty"), true); return; }
  const timer = setInterval(draw, 1000 / FILM_RATE);
  const late = setTimeout(() => { if (filming.value) filming.value(); }, FILM_MAX);
  filmed.value = 0;
  recorder.ondataavailable = ({ data }) => { parts.push(data); filmed.value += data.size; };
  recorder.onstop = () => {
    if (!filmed.value) { say(t("film.empty"), true); return; }
    saveAs(new Blob(parts, { type: recorder.mimeType }), `${robot}.${recorder.mimeType.includes("mp4") ? "mp4" : "webm"}`);
  };
  recorder.start(1000);
  filming.value = () => { clearInterval(timer); clearTimeout(late); filming.value = null; recorder.stop(); };
}

export function Camera() {
  const robot = current.value, tries = useSignal(0);
  return html`<div class="card"><h3>${t("camera")}</h3><figure class="film" data-filmed=${filmed.value}>${shown.value ? html`<${Picture} key=${`${robot} ${connections.value} ${tries.value}`} robot=${robot} again=${() => { tries.value += 1; }} />` : html`<p class="muted">${t("camera.off")}</p>`}
    <figcaption class="buttons"><${Button} label=${t(shown.value ? "camera.close" : "camera.open")} onClick=${() => { shown.value = !shown.value; }} />
    ${shown.value && html`<${Button} label=${t("camera.boxes")} on=${boxes.value} onClick=${() => { boxes.value = !boxes.value; }} />`}
    ${shown.value && hears.value && html`<${Button} label=${t("camera.sound")} on=${loud.value} onClick=${() => { loud.value = !loud.value; }} />`}
    ${shown.value && html`<${Button} kind=${filming.value ? "danger" : ""} label=${t(filming.value ? "film.stop" : "film.start")} onClick=${(e) => { if (filming.value) filming.value(); else film(e.currentTarget.closest("figure"), robot); }} />`}
    <a class="button" href=${`/api/robots/${robot}/camera.jpg`} download=${`${robot}.jpg`}>${t("photo")}</a></figcaption></figure></div>`;
}
