// The program that scripts/studio_pictures.py shows.
() => {
  const n = (value) => ({ shadow: { type: 'math_number', fields: { NUM: value } } });
  const r = (value, min, max) => ({ shadow: { type: 'robot_number', extraState: { min, max }, fields: { NUM: value } } });
  const words = (text) => ({ shadow: { type: 'text', fields: { TEXT: text } } });
  studio.editor.load({ blocks: { languageVersion: 0, blocks: [{ type: 'cyberdog.motion.resume_standing', id: 'stand', x: 30, y: 30,
    next: { block: { type: 'variables_set', id: 'set', fields: { VAR: { name: 'corner' } }, inputs: { VALUE: n(0) },
    next: { block: { type: 'controls_repeat_ext', id: 'loop', inputs: { TIMES: n(4), DO: { block: {
      type: 'cyberdog.motion.go_straight', id: 'go', inputs: { x_velocity: r(0.5, -1.6, 1.6), distance: r(1, 0, 10), duration: r(1, 0, 3600) },
      next: { block: { type: 'cyberdog.motion.turn', id: 'turn', inputs: { angle: r(90, -360, 359.9), duration: r(1, 0, 6) },
      next: { block: { type: 'math_change', id: 'count', fields: { VAR: { name: 'corner' } }, inputs: { DELTA: n(1) },
      next: { block: { type: 'text_print', id: 'say', inputs: { TEXT: { block: { type: 'text_join', extraState: { itemCount: 2 },
        inputs: { ADD0: words('corner '), ADD1: { block: { type: 'variables_get', fields: { VAR: { name: 'corner' } } } } } } } } } } } } } } } } },
    next: { block: { type: 'cyberdog.audio.play', id: 'talk', inputs: { message: words('done'), volume: r(-1, -1, 100) } } } } } } } }] } });
  studio.editor.toggleBreak('say'); }
