"""Speaks HTTPS to a gateway with the TLS of OpenSSL.

    tls.py CERTIFICATE PORT TOKEN

Prints one JSON object: answers, the versions of TLS that were agreed on, and whether a client that does not know the certificate refuses it.
"""

import http.client
import json
import ssl
import sys

certificate, port, token = sys.argv[1], int(sys.argv[2]), sys.argv[3]


def context(version=None):
    made = ssl.create_default_context(cafile=certificate)
    if version:
        made.minimum_version = made.maximum_version = version
    return made


def ask(method, path, headers={}):
    connection = http.client.HTTPSConnection("localhost", port, context=context(), timeout=20)
    connection.request(method, path, headers=headers)
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def version(wanted):
    connection = http.client.HTTPSConnection("localhost", port, context=context(wanted), timeout=20)
    connection.connect()
    agreed = connection.sock.version()
    connection.close()
    return agreed


report = {"health": ask("GET", "/healthz"), "offer": json.loads(ask("GET", "/api/v1/session")[1])}
status, body = ask("POST", "/api/v1/session", {"Authorization": f"Bearer {token}"})
report["session"], report["key"] = status, len(json.loads(body)["session"])
report["versions"] = {"TLSv1.2": version(ssl.TLSVersion.TLSv1_2), "TLSv1.3": version(ssl.TLSVersion.TLSv1_3)}
try:
    http.client.HTTPSConnection("localhost", port, context=ssl.create_default_context(), timeout=20).request("GET", "/")
    report["untrusted"] = False
except ssl.SSLCertVerificationError:
    report["untrusted"] = True
print(json.dumps(report))
