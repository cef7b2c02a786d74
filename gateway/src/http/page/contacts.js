
// ---- first contacts: asked for every few seconds while the page is looked at ---------------------------------

const CONTACTS_EVERY_MS = 3000;
const CONTACT_PHASES = {
  forward_open: 'Forward_Open',
  configuration: 'configuration services',
  group_sync: 'group sync',
  synchronous: 'synchronous operation',
  first_enable: 'first enable',
};
const CONTACT = ['Contact', 'Time', 'Device', 'Reached', 'Refused', 'Awaited', 'End'].map((name) => ({ name }));

function contactCells(contact) {
  const times = (count) => (count > 1 ? `, ${count} times` : '');
  const lines = (list) => list.join('; ') || '–';
  const end = contact.end;
  return [
    `${contact.number}: ${contact.kind}, ${contact.peer}`,
    contact.attempts > 1 ? `${contact.time}, ${contact.attempts} attempts until ${contact.last}` : contact.time,
    contact.device,
    lines(contact.phases.map((one) => `${CONTACT_PHASES[one.phase] || one.phase} after ${one.after_ms} ms`)),
    lines(contact.refused.map((one) => `${one.service}: ${one.reason}${times(one.count)}`)),
    lines(contact.awaited),
    end ? `${end.after_ms === null ? '' : `after ${end.after_ms} ms, `}${end.by}` : 'open',
  ];
}

function showContacts({ contacts }) {
  document.getElementById('no-contacts').hidden = contacts.length > 0;
  document.getElementById('contact-table').hidden = contacts.length === 0;
  const body = document.getElementById('contacts');
  while (body.children.length > contacts.length) body.lastElementChild.remove();
  contacts.forEach((contact, index) => {
    const row = body.children[index] || body.appendChild(document.createElement('tr'));
    contactCells(contact).forEach((text, column) => {
      let cell = row.children[column];
      if (!cell) {
        cell = row.appendChild(document.createElement(column === 0 ? 'th' : 'td'));
        if (column === 0) cell.scope = 'row';
        else cell.dataset.label = CONTACT[column].name;
        cell.appendChild(document.createElement('span')).className = 'value';
        if (column === 0) cell.appendChild(document.createElement('a')).textContent = 'frames';
      }
      const value = cell.firstElementChild;
      if (value.textContent !== text) value.textContent = text;
      if (column === 0) {
        const link = cell.lastElementChild;
        link.href = `/contact.pcapng?number=${contact.number}`;
        link.download = `contact-${contact.number}.pcapng`;
        link.hidden = contact.frames === 0;
      }
    });
  });
}

async function askForContacts() {
  if (!document.hidden) {
    try {
      const answer = await fetch('/api/v1/contacts');
      if (answer.ok) showContacts(await answer.json());
    } catch {
      // The page says that the gateway is gone.
    }
  }
  setTimeout(askForContacts, CONTACTS_EVERY_MS);
}

askForContacts();
