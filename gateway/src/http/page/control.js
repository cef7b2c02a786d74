
// ---- local control of an axis: everything stops when this page goes, is hidden, or is not heard ------------------

// The key of the session is kept in the memory of the page alone. `held` is the direction of the jog that is held. `owner` is that of the
// axis by the stream; `ours` says that an order of this stream may be why it is `local`, and `pending` counts orders without a reply.
const control = {
  offer: null, asking: false, key: null, socket: null, beat: 0, axis: null, nodes: null, allowed: false,
  state: '', owner: '', ours: false, pending: 0, held: null,
};

const DECIMAL = /^\d{1,9}(\.\d{1,9})?$/;
const SIGNED = /^[+-]?\d{1,9}(\.\d{1,9})?$/;

function button(parent, text, className, action) {
  const node = parent.appendChild(element('button', className, text));
  node.type = 'button';
  if (action) node.addEventListener('click', action);
  return node;
}

function field(parent, text, id) {
  const label = parent.appendChild(element('label', '', text));
  const input = label.appendChild(element('input'));
  input.id = id;
  input.inputMode = 'decimal';
  input.autocomplete = 'off';
  return input;
}

function row(parent, className) {
  return parent.appendChild(element('div', `row ${className || ''}`.trim()));
}

function buildControl(node, axis) {
  giveBack('');
  node.classList.add('control');
  const says = node.appendChild(element('p', 'says'));
  says.id = 'control-says';
  says.setAttribute('role', 'status');
  const login = node.appendChild(element('form', 'row login'));
  const label = login.appendChild(element('label', '', 'Token'));
  const secret = label.appendChild(element('input'));
  Object.assign(secret, { type: 'password', id: 'token', autocomplete: 'off', required: true });
  const enter = login.appendChild(element('button', '', 'Log in'));
  enter.id = 'log-in';
  login.addEventListener('submit', (event) => {
    event.preventDefault();
    logIn(secret);
  });
  const parts = node.appendChild(element('div'));
  const caution = parts.appendChild(element('p', 'says waits',
    'Nobody may be in the danger zone. The axis stops when you release the button, leave the page or lose the network, but this is not a safety function.'));
  const session = row(parts);
  const take = button(session, 'Take control', '', () => takeControl());
  take.id = 'take-control';
  const back = button(session, 'Give back', '', () => giveBack('Control was given back: the axis stops and loses its torque.'));
  const out = button(session, 'Log out', '', () => logOut());
  const power = session;
  const enable = button(power, 'Enable', '', () => order('enable'));
  const disable = button(power, 'Disable', '', () => order('disable'));
  const reset = button(power, 'Reset faults', '', () => order('reset'));
  const unit = last.status.axes.find((known) => known.name === axis).unit;
  const values = row(parts);
  const velocity = field(values, `Velocity, ${unit}/s`, 'control-velocity');
  const acceleration = field(values, `Acceleration, ${unit}/s²`, 'control-acceleration');
  const jogs = values.appendChild(element('div', 'jogs'));
  const [minus, plus] = [['-', 'Jog −'], ['', 'Jog +']].map(([sign, text]) => {
    const jog = button(jogs, text, 'jog');
    jog.title = 'Moves while it is held';
    jog.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      // What leaves the button is still the button's, until it is released.
      jog.setPointerCapture(event.pointerId);
      hold(sign, jog);
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur']) jog.addEventListener(end, release);
    jog.addEventListener('contextmenu', (event) => event.preventDefault());
    jog.addEventListener('keydown', (event) => {
      if (event.key !== ' ' && event.key !== 'Enter') return;
      event.preventDefault();
      if (!event.repeat) hold(sign, jog);
    });
    return jog;
  });
  [minus.id, plus.id] = ['jog-minus', 'jog-plus'];
  const moves = row(parts);
  const target = field(moves, `Position, ${unit}`, 'control-position');
  const move = button(moves, 'Move to', '', () => moveTo());
  const home = button(moves, 'Home', '', () => order('home'));
  [enable.id, disable.id, move.id] = ['enable', 'disable', 'move-to'];
  const live = parts.appendChild(element('p', 'live'));
  live.id = 'control-live';
  // Arrow keys in the section, but not where something is written.
  node.addEventListener('keydown', (event) => {
    const jog = { ArrowLeft: ['-', minus], ArrowRight: ['', plus] }[event.key];
    if (!jog || event.target.tagName === 'INPUT') return;
    event.preventDefault();
    if (!event.repeat) hold(...jog);
  });
  Object.assign(control, {
    axis,
    state: '',
    nodes: { says, login, secret, parts, caution, take, back, out, enable, disable, reset, velocity, acceleration, minus, plus, target, move, home, live },
    said: null,
  });
}

// Asks whether axes can be controlled from here. The next event asks again if there was no answer.
function askForOffer() {
  if (control.offer !== null || control.asking) return;
  control.asking = true;
  fetchOnce('/api/v1/session', (offer) => {
    control.offer = offer;
    control.asking = false;
  }, () => {
    control.asking = false;
  });
}

// What is written into empty fields: a tenth of the velocity limit.
function suggest(limits) {
  const { velocity, acceleration } = control.nodes;
  if (limits.velocity !== null && velocity.value === '') velocity.value = String(Number((limits.velocity / 10).toPrecision(6)));
  acceleration.placeholder = limits.acceleration === null ? 'needed' : `limit: ${limits.acceleration}`;
}

// Says something, until something else is to be said.
function say(text, tone) {
  control.said = text ? { text, tone: tone || '' } : null;
  if (control.nodes && control.said) {
    setText(control.nodes.says, text);
    setClass(control.nodes.says, `says ${tone || ''}`.trim());
  }
}

const isOpen = () => control.socket !== null && control.socket.readyState === WebSocket.OPEN;

// Why the axis cannot be controlled now; nothing if it can.
function obstacle(axis) {
  if (control.offer === null) return ['Asking the gateway whether axes can be controlled from here.', ''];
  if (!control.offer.control) return ['Axes cannot be controlled from this page: no token is configured (`token` in `[http]`).', 'waits'];
  if (axis.owner === 'controller') return ['A controller owns this axis. Local control has to wait until it has disconnected.', 'waits'];
  if (control.key === null) return ['Log in with the token to control this axis.', ''];
  // An open stream alone is no control: an axis is taken by the first order.
  const isOthers = isOpen() ? control.owner === 'local' && !control.ours : axis.owner === 'local';
  if (isOthers) return ['Another client of local control has this axis.', 'waits'];
  return null;
}

function showControl(axis) {
  const { nodes } = control;
  askForOffer();
  const why = obstacle(axis);
  const isOffered = control.offer !== null && control.offer.control;
  nodes.login.hidden = !isOffered || control.key !== null;
  nodes.parts.hidden = !isOffered;
  control.allowed = why === null;
  if (why !== null && isOpen()) giveBack('');
  if (why !== null && (control.said === null || axis.owner === 'controller' || !isOffered)) {
    setText(nodes.says, why[0]);
    setClass(nodes.says, `says ${why[1]}`.trim());
  } else if (why === null && control.said === null) {
    const plain = control.offer.encrypted ? '' : ' This connection is not encrypted.';
    const open = control.ours ? 'You have control.' : 'You can enable the axis: nobody has it.';
    setText(nodes.says, isOpen() ? open : `You are logged in.${plain}`);
    setClass(nodes.says, 'says');
  }
  showButtons();
}

function showButtons() {
  const { nodes, state, allowed } = control;
  if (!nodes) return;
  const has = allowed && isOpen();
  const operates = has && state === 'operating';
  const set = (names, enabled) => names.forEach((name) => { nodes[name].disabled = !enabled; });
  set(['take'], allowed && control.socket === null);
  set(['back'], control.socket !== null);
  set(['out'], control.key !== null);
  set(['enable', 'disable', 'reset'], has);
  set(['minus', 'plus', 'move', 'home'], operates);
  // A button that is disabled sees no release.
  if (!operates) release();
  nodes.caution.hidden = !isOpen();
  byId('stop-bar').hidden = control.socket === null;
  document.body.classList.toggle('has-control', control.socket !== null);
  setText(byId('stop-axis'), control.axis || '');
}

async function logIn(secret) {
  const token = secret.value;
  secret.value = '';
  say('The token is being verified.');
  try {
    const answer = await fetch('/api/v1/session', { method: 'POST', headers: { Authorization: `Bearer ${token}` } });
    if (answer.ok) {
      control.key = (await answer.json()).session;
      say('');
    } else {
      say(`Not logged in: ${(await answer.text()).trim()}.`, 'fault');
    }
  } catch {
    say('Not logged in: the gateway does not answer, or the token has characters that a token cannot have.', 'fault');
  }
  if (last) show(last);
}

function logOut() {
  const { key } = control;
  giveBack('');
  control.key = null;
  say('You are logged out.');
  fetch('/api/v1/session', { method: 'DELETE', headers: { Authorization: `Bearer ${key}` } }).catch(() => {});
  if (last) show(last);
}

function takeControl() {
  if (!control.allowed || control.socket !== null || document.hidden) return;
  const scheme = window.location.protocol === 'https:' ? 'wss' : 'ws';
  const socket = new WebSocket(`${scheme}://${window.location.host}/api/v1/control`,
    ['axisbridge.control', `axisbridge.session.${control.key}`]);
  let opened = false;
  control.socket = socket;
  Object.assign(control, { beat: 0, state: '', owner: '', ours: false, pending: 0 });
  say('');
  socket.addEventListener('open', () => {
    opened = true;
    showButtons();
    control.nodes.enable.focus();
  });
  socket.addEventListener('message', (event) => {
    if (control.socket === socket) hear(event.data);
  });
  socket.addEventListener('close', (event) => {
    if (control.socket !== socket) return;
    control.socket = null;
    release();
    loseWrite();
    if (opened) {
      say(`Control is lost: ${event.reason || 'the connection has ended'}. The axis stops and loses its torque.`, 'fault');
    } else {
      control.key = null;
      say('The gateway gives no control: log in again.', 'fault');
    }
    showButtons();
  });
  showButtons();
}

// Ends control: the axis stops and loses its torque when the gateway sees the end of the stream.
function giveBack(text) {
  const { socket } = control;
  if (socket === null) return;
  control.held = null;
  control.socket = null;
  control.state = '';
  socket.close();
  loseWrite();
  say(text);
  showButtons();
}

// Each request begins with the newest beat: the gateway does not move by one that comes late.
function send(line) {
  if (isOpen()) control.socket.send(`${control.beat} ${line}`);
}

// An order takes an axis that nobody has.
function sendOrder(line) {
  if (!isOpen()) return;
  control.ours = true;
  control.pending += 1;
  send(line);
}

function order(word, rest) {
  say('');
  sendOrder(`${word} ${control.axis}${rest || ''}`);
}

function withAcceleration() {
  const text = control.nodes.acceleration.value.trim();
  return text === '' ? '' : ` acceleration=${text}`;
}

// Whether the fields have numbers; what is wrong is said.
function areNumbers(...fields) {
  const wrong = fields.find(([input, form, empty]) => !(form.test(input.value.trim()) || (empty && input.value.trim() === '')));
  if (!wrong) return true;
  say(`${wrong[0].parentElement.firstChild.textContent}: a decimal number is needed.`, 'fault');
  wrong[0].focus();
  return false;
}

function moveTo() {
  const { target, velocity, acceleration } = control.nodes;
  if (!areNumbers([target, SIGNED], [velocity, DECIMAL], [acceleration, DECIMAL, true])) return;
  order('move', ` ${target.value.trim()} velocity=${velocity.value.trim()}${withAcceleration()}`);
}

function hold(sign, node) {
  const { velocity, acceleration } = control.nodes;
  if (node.disabled || control.held !== null || !areNumbers([velocity, DECIMAL], [acceleration, DECIMAL, true])) return;
  control.held = { node, line: `jog ${control.axis} ${sign}${velocity.value.trim()}${withAcceleration()}` };
  node.classList.add('held');
  say('');
  sendOrder(control.held.line);
}

function release() {
  const { held } = control;
  if (held === null) return;
  control.held = null;
  held.node.classList.remove('held');
  sendOrder(`stop ${control.axis}`);
}

function stopAxis() {
  release();
  sendOrder(`stop ${control.axis}`);
}

const ORDERS = ['enable', 'disable', 'reset', 'move', 'home', 'jog', 'stop'];
const WORDS = (reply) => Object.fromEntries(reply.split(' ').filter((word) => word.includes('=')).map((word) => word.split('=')));

// A beat is answered at once: by the jog that is held, or a question for the state.
function hear(text) {
  if (text.startsWith('beat ')) {
    control.beat = Number(text.slice(5));
    if (control.held) sendOrder(control.held.line);
    else send(`status ${control.axis}`);
    return;
  }
  const [, verdict, word, axis, rest] = /^(ok|error) (\S+) (\S+) ?(.*)$/.exec(text) || [];
  if (ORDERS.includes(word)) control.pending = Math.max(0, control.pending - 1);
  if (word === 'write') {
    hearWrite(verdict, rest);
  } else if (verdict === 'error') {
    const [, code, why] = /^(\S+): (.*)$/.exec(rest) || [null, '', rest];
    if (word === 'jog') release();
    if (code === 'held') control.ours = false;
    // A stop or a move that gives way to what was asked after it.
    if (code !== 'replaced') say(`${word}: ${why}`, 'fault');
  } else if (axis === control.axis) {
    const known = WORDS(rest);
    control.state = known.state || '';
    control.owner = known.owner || '';
    // It was given up again, or never taken: the next one who takes it may be somebody else.
    if (control.owner !== 'local' && control.pending === 0) control.ours = false;
    const { nodes } = control;
    setText(nodes.live, `State ${known.state}, position ${known.position} ${known.unit}, velocity ${known.velocity} ${known.unit}/s`);
    if (['move', 'home', 'enable', 'disable', 'reset'].includes(word)) say(`${word}: done`, 'good');
  }
  showButtons();
}

byId('stop').addEventListener('click', stopAxis);
window.addEventListener('keydown', (event) => {
  if (event.key === 'Escape' && control.socket !== null) stopAxis();
});
// Any key: one that is released ends the jog, wherever the focus has gone.
window.addEventListener('keyup', release);
window.addEventListener('blur', release);
document.addEventListener('visibilitychange', () => {
  if (document.hidden) giveBack('Control was given back: the page was hidden.');
});
window.addEventListener('pagehide', () => giveBack(''));
