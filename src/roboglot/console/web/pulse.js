// Whether the other end of a socket still answers: it is asked every second.
const EVERY = 1000, SILENT_MAX = 10_000; // ms between two questions; without an answer after which the link counts as lost

/** Ask until the end. @param {(message: object) => void} send @param {() => void} lost called once: the socket's own end may take minutes
 * @param {(age: number) => void} [aged] ms there and back; of an open question, since it was asked */
export function pulse(send, lost, aged = () => {}) {
  let asked = 0, timer = 0;
  function beat() {
    clearTimeout(timer);
    const now = performance.now();
    if (!asked) {
      asked = now;
      send({ type: "ping", at: now });
    } else {
      aged(now - asked);
      if (now - asked > SILENT_MAX) { lost(); return; }
    }
    timer = window.setTimeout(beat, EVERY);
  }
  return {
    begin() { asked = 0; beat(); },
    /** @param {number} at when the question was sent */
    answered(at) { asked = 0; aged(performance.now() - at); },
    end() { clearTimeout(timer); },
  };
}
