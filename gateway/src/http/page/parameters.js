
// ---- parameters of the drive of an axis: only what is on the screen is read, one request at a time -----------

const PARAMETER = ['Parameter', 'Value', 'Range', 'Written', 'New value'];
const PARAMETERS_SHOWN = 25;
const PARAMETERS_AT_ONCE = 4;
const PARAMETER_EVERY_MS = 3000;
const PARAMETER_TICK_MS = 200;
const PARAMETER_SAFE = /^[\w.:-]+$/;
const PARAMETER_SOURCES = { file: 'the device file', dictionary: 'the dictionary of the gateway; the drive may lack some' };

// `known` has what was heard of each parameter, `lines` the rows that are shown, `write` the one that is on its way.
const parameters = { axis: null, list: null, known: new Map(), lines: [], first: 0, busy: false, write: null, failed: 0, nodes: null };

function buildParameters(node, axis) {
  node.classList.add('parameters');
  const label = node.appendChild(element('label', '', 'Show only rows with '));
  const filter = label.appendChild(element('input'));
  Object.assign(filter, { type: 'search', id: 'parameter-filter', placeholder: 'number or name', autocomplete: 'off' });
  const note = node.appendChild(element('p', 'note'));
  note.id = 'parameter-note';
  const says = node.appendChild(element('p', 'says'));
  says.id = 'parameter-says';
  says.setAttribute('role', 'status');
  says.hidden = true;
  const body = table(node, PARAMETER);
  body.id = 'parameter-rows';
  const pager = row(node, 'pager');
  const previous = button(pager, 'Previous', '', () => turnParameters(-1));
  const next = button(pager, 'Next', '', () => turnParameters(1));
  const place = pager.appendChild(element('span'));
  if (parameters.observer) parameters.observer.disconnect();
  const observer = new IntersectionObserver((entries) => {
    for (const entry of entries) entry.target.isOnScreen = entry.isIntersecting;
  });
  Object.assign(parameters, {
    axis, list: null, known: new Map(), lines: [], first: 0, write: null, failed: 0, observer,
    nodes: { section: node, filter, note, says, body, pager, previous, next, place },
  });
  // The list itself is an access to the drive: it is asked for when somebody comes to it.
  observer.observe(node);
  filter.addEventListener('input', () => {
    parameters.first = 0;
    fillParameters();
  });
}

function parameterText(listed) {
  return `${listed.id} ${listed.name || ''}`.toLowerCase();
}

function turnParameters(by) {
  parameters.first += by * PARAMETERS_SHOWN;
  fillParameters();
  parameters.nodes.filter.scrollIntoView({ block: 'nearest' });
}

// The rows of the list that are wanted, from the first that is shown.
function fillParameters() {
  const { nodes, list, observer } = parameters;
  if (list === null) return;
  const wanted = nodes.filter.value.trim().toLowerCase();
  const found = list.parameters.filter((listed) => parameterText(listed).includes(wanted));
  parameters.first = Math.max(0, Math.min(parameters.first, found.length - 1));
  parameters.first -= parameters.first % PARAMETERS_SHOWN;
  const { first } = parameters;
  const shown = found.slice(first, first + PARAMETERS_SHOWN);
  for (const line of parameters.lines) observer.unobserve(line.node);
  nodes.body.replaceChildren();
  parameters.lines = shown.map(parameterLine);
  for (const line of parameters.lines) observer.observe(line.node);
  const of = PARAMETER_SOURCES[list.source] || `${list.source} of the drive`;
  setText(nodes.note, `${found.length} of ${list.parameters.length} parameters, from ${of}. Rows on the screen are read every few seconds.`);
  nodes.pager.hidden = found.length <= PARAMETERS_SHOWN;
  nodes.previous.disabled = first === 0;
  nodes.next.disabled = first + PARAMETERS_SHOWN >= found.length;
  setText(nodes.place, `${first + 1} to ${first + shown.length} of ${found.length}`);
  showParameters();
}

function parameterLine(listed) {
  const node = parameters.nodes.body.appendChild(element('tr'));
  node.id = `parameter-${listed.id}`;
  const head = node.appendChild(element('th'));
  head.scope = 'row';
  head.appendChild(element('span', 'value', listed.id));
  const name = head.appendChild(element('span', 'more'));
  const cells = PARAMETER.slice(1).map((title) => {
    const cell = node.appendChild(element('td'));
    cell.dataset.label = title;
    return [cell, cell.appendChild(element('span', 'value')), cell.appendChild(element('span', 'more'))];
  });
  const [value, range, written, wish] = cells;
  const form = element('form', 'wish');
  const input = form.appendChild(element('input'));
  input.autocomplete = 'off';
  input.setAttribute('aria-label', `New value of ${listed.id}`);
  const submit = form.appendChild(element('button', '', 'Write'));
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    writeParameter(listed, input.value.trim());
  });
  wish[0].insertBefore(form, wish[2]);
  wish[2].setAttribute('role', 'status');
  return { listed, node, name, value, range, written, form, input, submit, result: wish[2] };
}

// What is known of a parameter: its report, when it was asked for, and what became of a write.
function knownOf(id) {
  if (!parameters.known.has(id)) parameters.known.set(id, { report: null, refused: null, at: -Infinity, result: null });
  return parameters.known.get(id);
}

const between = (low, high) => (low || high ? `${low || '…'} to ${high || '…'}` : '');
// In the words of the list, before the drive was asked.
const WRITABLE = { read: 'never', ro: 'never', const: 'never', write: 'at any time', write_while_disabled: 'without torque' };
const writableOf = ({ listed }, { report }) => (report && report.writable) || WRITABLE[listed.access] || '';
const canWrite = (text) => text === '' || text === 'without torque' || text === 'at any time';

function showParameters() {
  const { nodes, lines } = parameters;
  if (!nodes) return;
  const open = isOpen();
  for (const line of lines) {
    const known = knownOf(line.listed.id);
    const { report, refused } = known;
    const listed = line.listed;
    const of = (key) => (report && report[key]) || listed[key] || '';
    setText(line.name, of('name'));
    const unit = of('unit');
    setText(line.value[1], report ? [report.value, unit].filter(Boolean).join(' ') : refused ? 'not read' : '…');
    setClass(line.value[1], report ? 'value' : refused ? 'warn' : 'value');
    setText(line.value[2], refused ? refused.text : of('type'));
    line.value[2].hidden = line.value[2].textContent === '';
    setText(line.range[1], between(of('minimum'), of('maximum')));
    const writable = writableOf(line, known);
    setText(line.written[1], writable);
    line.form.hidden = !open || !report || !canWrite(writable);
    line.submit.disabled = parameters.write !== null || control.state === 'operating';
    setText(line.result, known.result ? known.result.text : '');
    setClass(line.result, `more ${known.result ? known.result.tone : ''}`.trim());
    line.result.hidden = !known.result;
  }
  const why = !control.offer ? '' : !control.offer.control ? 'Parameters are read only here: no token is configured.'
    : control.key === null ? 'Parameters are read only until you log in at Local control.'
      : !open ? 'Take control to write parameters.'
        : control.state === 'operating' ? 'Parameters are not written while the axis has torque: press Disable first.' : '';
  setText(nodes.says, why);
  nodes.says.hidden = why === '';
}

// A write goes the way of a jog: with the newest beat, over the stream of the one who has control.
function writeParameter(listed, text) {
  const known = knownOf(listed.id);
  if (!isOpen() || parameters.write !== null) return;
  if (text === '') {
    known.result = { text: 'A value is needed.', tone: 'bad' };
  } else {
    known.result = { text: 'The drive is asked …', tone: '' };
    parameters.write = { id: listed.id };
    send(`write ${control.axis} ${listed.id} ${text}`);
  }
  showParameters();
}

// The reply to a write: what the drive has afterwards, or its refusal.
function hearWrite(verdict, rest) {
  const { write } = parameters;
  if (write === null) return;
  parameters.write = null;
  const known = knownOf(write.id);
  // What the drive has now is read at once.
  known.at = -Infinity;
  if (verdict === 'ok' && rest.startsWith('{')) {
    const report = JSON.parse(rest);
    known.report = { ...known.report, ...report };
    const again = report.recommission ? ' The axis cannot be enabled before its drive was commissioned again.' : '';
    known.result = { text: `Kept: ${report.value}, before ${report.before}.${again}`, tone: 'good' };
  } else if (verdict === 'ok') {
    // `NAME=VALUE unit=UNIT`: a parameter with a name. The gateway has read it back where the drive lets it be read.
    const [, value] = /=(\S+)/.exec(rest) || [null, ''];
    known.result = { text: `Written: ${value}.`, tone: 'good' };
  } else {
    const [, code, why] = /^(\S+): (.*)$/.exec(rest) || [null, '', rest];
    known.result = { text: `${code === 'not-kept' ? 'Not kept' : 'Refused'}: ${why}`, tone: 'bad' };
  }
  showParameters();
}

// The stream has ended.
function loseWrite() {
  if (parameters.write !== null) {
    knownOf(parameters.write.id).result = { text: 'It is not known whether the drive has taken it: control was lost.', tone: 'bad' };
    parameters.write = null;
  }
  showParameters();
}

function takeParameter({ id, report, refused }, now) {
  const known = knownOf(id);
  known.at = now;
  known.refused = refused;
  // What was said before, such as limits, stays; a value that cannot be read does not.
  known.report = report ? { ...known.report, ...report } : null;
}

// What is to be read next: rows that nothing is known of with all that the drive says, others again without unit and limits.
function wantedParameters(now) {
  const { lines, write } = parameters;
  // The write is the one access of this page.
  if (write !== null) return null;
  const due = lines.filter(({ node, listed }) => node.isOnScreen && PARAMETER_SAFE.test(listed.id)
    && now - knownOf(listed.id).at > PARAMETER_EVERY_MS);
  const fresh = due.filter(({ listed }) => knownOf(listed.id).report === null);
  const lot = (fresh.length ? fresh : due).slice(0, PARAMETERS_AT_ONCE);
  return lot.length ? { ids: lot.map(({ listed }) => listed.id), brief: fresh.length === 0 } : null;
}

async function readParameters() {
  const { axis, nodes } = parameters;
  const isShown = current.view === 'axis' && current.name === axis && !document.hidden && !document.body.classList.contains('stale');
  if (!nodes || parameters.busy || !isShown || !nodes.section.isOnScreen) return;
  const now = performance.now();
  const lot = parameters.list === null ? null : wantedParameters(now);
  if (parameters.list === null ? now < parameters.failed : lot === null) return;
  parameters.busy = true;
  try {
    const path = lot === null ? `/api/v1/parameters?axis=${axis}`
      : `/api/v1/parameter?axis=${axis}&${lot.ids.map((id) => `id=${id}`).join('&')}${lot.brief ? '&brief' : ''}`;
    const answer = await fetch(path);
    const text = await answer.text();
    if (parameters.axis !== axis) return;
    if (!answer.ok) throw new Error(text.trim());
    if (lot === null) {
      parameters.list = JSON.parse(text);
      fillParameters();
    } else {
      for (const one of JSON.parse(text).parameters) takeParameter(one, performance.now());
      showParameters();
    }
  } catch (error) {
    if (parameters.axis !== axis) return;
    setText(nodes.note, `The parameters cannot be read now: ${error.message}`);
    parameters.failed = performance.now() + PARAMETER_EVERY_MS;
    if (lot !== null) for (const id of lot.ids) knownOf(id).at = performance.now();
  } finally {
    parameters.busy = false;
  }
}

setInterval(readParameters, PARAMETER_TICK_MS);
